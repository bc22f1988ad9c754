/** The Stop button: on press, without confirmation, in any state; and its text when the server does not respond. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Stop } from "../api/types";
import { stop } from "../bench/bench";
import { link } from "../bench/link";
import { unsent } from "../bench/stop";
import { StopButton } from "./stop-button";

let host: HTMLElement;
let sent: { url: string; body: unknown; keepalive: boolean | undefined }[];
let reachable: boolean;

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  sent = [];
  reachable = true;
  unsent.value = null;
  stop.value = null;
  link.value = { state: "up", since: 0 };
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    sent.push({ url, body: JSON.parse(String(init.body)), keepalive: init.keepalive });
    if (!reachable) throw new TypeError("refused");
    return new Response(
      JSON.stringify({ latched: true, mode: "off", at: 1, by: "Page 1", reason: "", servos: [] }),
    );
  });
  act(() => render(<StopButton />, host));
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
  vi.unstubAllGlobals();
});

const button = () => host.querySelector("button") as HTMLButtonElement;
const press = (type: string, init: PointerEventInit & { detail?: number } = {}) =>
  act(async () => {
    const Kind = type === "click" ? MouseEvent : PointerEvent;
    button().dispatchEvent(new Kind(type, { bubbles: true, button: 0, ...init }));
    await new Promise(resolve => setTimeout(resolve, 2));
  });

describe("StopButton", () => {
  test("acts on press, before release, and only once for press and click together", async () => {
    await press("pointerdown");
    expect(sent).toHaveLength(1);
    expect(sent[0]?.url).toMatch(/^\/api\/v1\/stop\?by=/);
    expect(sent[0]).toMatchObject({ body: { mode: "off" }, keepalive: true });
    await press("pointerup");
    await press("click", { detail: 1 });
    expect(sent).toHaveLength(1);
  });

  test("acts on Enter or Space, and for assistive technology, which only click", async () => {
    await press("click", { detail: 0 });
    expect(sent).toHaveLength(1);
  });

  test("stays a stop button while latched: pressing sends again", async () => {
    await press("pointerdown");
    expect(button().textContent).toContain("STOPPED");
    expect(button().textContent).toContain("Press to send again");
    await press("pointerdown");
    expect(sent).toHaveLength(2);
  });

  test("without a link it says what to do instead, and still tries", async () => {
    act(() => {
      link.value = { state: "down", since: 0 };
    });
    reachable = false;
    expect(button().textContent).toContain("NO LINK");
    expect(button().textContent).toContain("cut the supply");
    expect(button().disabled).toBe(false);
    await press("pointerdown");
    expect(sent).toHaveLength(1);
    expect(unsent.value).toContain("Stop did not reach hornbill. Cut the supply.");
  });

  test("a stop seen from elsewhere latches this page too", () => {
    act(() => {
      stop.value = {
        latched: true,
        mode: "off",
        at: 1,
        by: "Rig 3",
        reason: "",
        servos: [],
        nodes: [],
        reach: "all",
        reaches: [],
      } as Stop;
    });
    expect(button().dataset.latched).toBe("true");
  });
});
