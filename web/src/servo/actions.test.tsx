/** Actions of a servo: a refusal is said where they were pressed, and the question before them is complete. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { type KnownServo, replaceAll, servo } from "../bench/fleet";
import { listen } from "../bench/keys";
import { link } from "../bench/link";
import { wiggled } from "../bench/wiggle";
import { ChangeDialog } from "../change/dialog";
import { beginChange, begun, ChangeFlow, type ChangeRequest, shownChange } from "../change/flow";
import { resetChange, restartChange } from "../change/requests";
import { stopButton } from "../testing/stop-button";
import { ServoActions } from "./actions";

const UID = "c".repeat(32);
const forecast = {
  code: "moves",
  moves: true,
  from_deg: 35,
  to_deg: 0,
  takes_s: 0.2,
  turn_count_lost: false,
  text: "",
  warnings: [],
  coded_warnings: [],
};
const change = { key: "angle_p_gain", before: 55, requested: 40, after: 55, verdict: "planned" };
const stored = { servo_id: 1, node_id: 10, origin: 0 };

let host: HTMLElement;
let noStop: () => void;
let sent: { path: string; body: Record<string, unknown> }[];
let response: { status: number; body: unknown };

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  noStop = stopButton();
  link.value = { state: "up", since: 0 };
  wiggled.value = null;
  shownChange.value = null;
  sent = [];
  replaceAll([
    { uid: UID, label: "Tail", online: true, state: "ready", unsaved: [], angle_deg: 35, age_s: 0 } as never,
  ]);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (init.method === "POST") sent.push({ path: url, body: JSON.parse(String(init.body ?? "{}")) });
    return new Response(JSON.stringify(response.body), { status: response.status });
  });
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
  noStop();
  vi.unstubAllGlobals();
});

const find = <T extends HTMLElement>(id: string) => host.querySelector<T>(`[data-testid="${id}"]`);
const known = () => servo(UID) as KnownServo;
async function open(request: ChangeRequest, plan: object): Promise<void> {
  response = { status: 200, body: plan };
  await act(async () => render(<ChangeDialog />, host));
  await act(async () => void (await beginChange(request)));
  sent = [];
}
const press = (id: string) => act(() => find(id)?.click());

describe("in the head", () => {
  beforeEach(() => act(() => render(<ServoActions one={known()} />, host)));

  test("a refused restart is said there, and no dialog opens", async () => {
    response = { status: 423, body: { code: "stopped", status: 423, detail: "Stopped." } };
    press("servo-menu");
    press("menu-restart");
    await vi.waitFor(() => expect(find("servo-says")?.textContent).toContain("Not restarted. Stopped"));
    expect(sent.map(one => one.body)).toEqual([{ dry_run: true }]);
    expect(find("restart-dialog")).toBeNull();
    expect(host.querySelector("[role=menu]")).toBeNull();
  });

  test("none is begun while another is under way, and the menu says so", () => {
    const flow = new ChangeFlow({ ...restartChange([UID]), facts: UID });
    flow.phase.value = "running";
    act(() => {
      begun.value = [flow];
    });
    press("servo-menu");
    expect(find("menu-restart")?.textContent).toContain("A change to this servo is in progress.");
    press("menu-restart");
    press("menu-factory-reset");
    expect(sent).toEqual([]);
    begun.value = [];
  });

  test("a menu goes by arrows and is left by Esc", () => {
    const forget = listen(window, () => {});
    press("servo-menu");
    const items = [...host.querySelectorAll<HTMLElement>("[role=menuitem]")];
    expect(document.activeElement).toBe(items[0]);
    act(() => {
      items[0]?.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowUp", bubbles: true }));
    });
    expect(document.activeElement).toBe(items.at(-1));
    act(() => {
      items.at(-1)?.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", bubbles: true }));
    });
    expect(host.querySelector("[role=menu]")).toBeNull();
    expect(document.activeElement).toBe(find("servo-menu"));
    forget();
  });

  test("W wiggles this servo, and what came of it is said", async () => {
    response = {
      status: 202,
      body: {
        id: "j",
        uid: UID,
        state: "succeeded",
        steps: [],
        error: null,
        result: { low_deg: 32, high_deg: 38 },
      },
    };
    const forget = listen(window, () => {});
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "w", bubbles: true }));
    await vi.waitFor(() => expect(find("servo-says")?.textContent).toContain("+32.0° to +38.0°"));
    expect(sent.map(one => one.path)).toEqual([expect.stringContaining(`/servos/${UID}/identify`)]);
    forget();
  });
});

describe("before a restart", () => {
  const show = (restart: object, lost: object[] = [change]) => open(restartChange([UID]), { lost, restart });

  test("what is lost and where the horn goes is said, and it must be free to turn", async () => {
    await show(forecast);
    expect(find("horn-forecast")?.textContent).toContain("+35.0° to 0.0°");
    expect(find("lost")?.textContent).toContain("1 value in RAM only is lost");
    expect(find("restart-angle_p_gain")?.textContent).toContain("55");
    expect(find<HTMLButtonElement>("restart-go")?.disabled).toBe(true);
    press("horn-free");
    expect(find<HTMLButtonElement>("restart-go")?.disabled).toBe(false);
  });

  test("a horn that does not move needs no tick", async () => {
    await show({ ...forecast, code: "holds", moves: false }, []);
    expect(find("nothing-changes")).not.toBeNull();
    expect(find("horn-free")).toBeNull();
    expect(find<HTMLButtonElement>("restart-go")?.disabled).toBe(false);
  });

  test("a supply near a limit is not said: nothing is written to ROM", async () => {
    const near = { code: "supply_near_limit", text: "near", params: { supply_v: 4.3, limit_v: 4 } };
    await show({ ...forecast, coded_warnings: [near] });
    expect(host.textContent).not.toContain("4.3");
  });
});

describe("before a factory reset", () => {
  const plan = { changes: [change], kept: stored, restart: forecast };

  beforeEach(() => open(resetChange(UID, "Tail"), plan));

  function type(text: string): void {
    const box = find<HTMLInputElement>("reset-name");
    if (!box) throw new Error("no box");
    act(() => {
      box.value = text;
      box.dispatchEvent(new Event("input", { bubbles: true }));
    });
  }

  test("the name is typed and the horn is free, or nothing can be pressed", () => {
    const go = () => find<HTMLButtonElement>("factory-reset-go")?.disabled;
    type("Tail");
    expect(go()).toBe(true);
    press("horn-free");
    expect(go()).toBe(false);
    type("tail");
    expect(go()).toBe(true);
  });

  test("losing the node ID needs a new confirmation, and the response is shown", async () => {
    response = {
      status: 200,
      body: { ...plan, kept: {}, changes: [change, { ...change, key: "servo_id", before: 1, requested: 0 }] },
    };
    press("reset-keep");
    await vi.waitFor(() => expect(find("factory-reset-servo_id")).not.toBeNull());
    expect(sent[0]?.body).toEqual({ dry_run: true, keep_identity: false });
    type("Tail");
    press("horn-free");
    response = { status: 202, body: { id: "r", uid: UID, state: "running", steps: [], error: null } };
    press("factory-reset-go");
    await vi.waitFor(() => expect(sent).toHaveLength(2));
    expect(sent[1]?.body).toEqual({ keep_identity: false });
  });

  test("where that is refused, the identity stays ticked and the reason is said", async () => {
    response = { status: 409, body: { code: "busy", status: 409, detail: "Tail is being worked on." } };
    press("reset-keep");
    await vi.waitFor(() =>
      expect(find("factory-reset-dialog")?.textContent).toContain("Tail is being worked on."),
    );
    expect(find<HTMLInputElement>("reset-keep")?.checked).toBe(true);
  });

  test("a supply near a limit is said: ROM is written", async () => {
    const near = { code: "supply_near_limit", text: "near", params: { supply_v: 4.3, limit_v: 4 } };
    const reported = { ...plan, restart: { ...forecast, coded_warnings: [near] } };
    await open(resetChange(UID, "Tail"), reported);
    expect(find("horn-forecast")?.textContent).toContain("4.3\u202fV");
  });
});
