/** Snapshots on a Japanese page: what is stored is in no language of the page, what is shown is in the reader's. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, expect, test, vi } from "vitest";

const UID = "d".repeat(32);

afterEach(() => {
  vi.unstubAllGlobals();
  vi.resetModules();
});

test("a manual snapshot is stored under the server's code, and worded in Japanese", async () => {
  vi.resetModules();
  const { setLanguage, wordsLoaded } = await import("../text/language");
  setLanguage("ja", (await import("../text/ja")).text);
  const { replaceAll } = await import("../bench/fleet");
  const { link } = await import("../bench/link");
  const { Snapshots } = await import("./snapshots");
  await wordsLoaded();
  const sent: unknown[] = [];
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const taken = {
      id: 7,
      uid: UID,
      at: 1,
      reason: "before tuning",
      reason_code: "manual",
      reason_params: {},
      by: "Page 4170",
      values: {},
      rom: {},
    };
    if (init.method !== "POST")
      return new Response(JSON.stringify(url.endsWith("/snapshots") ? [taken] : []));
    sent.push(JSON.parse(String(init.body)));
    return new Response(JSON.stringify(taken));
  });
  link.value = { state: "up", since: 0 };
  replaceAll([{ uid: UID, label: "Tail", online: true, age_s: 0 } as never]);
  const host = document.createElement("div");
  await act(async () => render(<Snapshots uid={UID} />, host));
  await vi.waitFor(() =>
    expect(host.querySelector('[data-testid="snapshot-7"]')?.textContent).toContain("手動"),
  );
  await act(async () => host.querySelector<HTMLElement>('[data-testid="take-snapshot"]')?.click());
  expect(sent).toEqual([{}]);
  await act(async () => render(null, host));
});
