/** After a write: Undo while there is something to take back, and what a restart took can be staged again. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Change, Reading, Row, Servo } from "../api/types";
import { catalog } from "../bench/catalog";
import { monotonic } from "../bench/clock";
import type { KnownServo } from "../bench/fleet";
import { link } from "../bench/link";
import { type Sheet, sheetOf } from "../bench/parameters";
import type { Lost } from "../parameters/lost";
import { LostLine } from "../parameters/lost-values";
import { UndoLine } from "./undo";

const UID = "7".repeat(32);
const root = document.createElement("div");
let sheet: Sheet;
let sent: string[];

const row = {
  key: "angle_limit_cw",
  label: "Angle limit CW",
  name: "0x38",
  kind: "number",
  unit: "°",
  per_unit: 10,
  choices: [],
} as unknown as Row;
const change = { key: row.key, before: 60, requested: 40, after: 40, verdict: "applied" } as Change;
const one = (more: Partial<Servo> & { bootAt?: number | null } = {}) =>
  ({ uid: UID, online: true, state: "ready", bootAt: 100, lost: [], ...more }) as unknown as KnownServo;

function holds(value: number): void {
  sheet.put({
    key: row.key,
    value,
    configured: value,
    raw: value * 10,
    rom: 60,
    age_s: 0,
    minimum: -180,
    maximum: 180,
  } as Reading);
}

beforeEach(() => {
  sent = [];
  sheet = sheetOf(UID);
  sheet.drafts.clear();
  holds(40);
  link.value = { state: "up", since: monotonic() };
  catalog.value = { rows: new Map([[row.key, row]]) } as unknown as typeof catalog.value;
  sheet.written.value = { at: 0, bootAt: 100, changes: [change] };
  document.body.append(root);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    sent.push(`${init.method} ${url}`);
    return new Response(null, { status: 204 });
  });
});

afterEach(() => {
  act(() => render(null, root));
  root.remove();
  sheet.written.value = null;
  catalog.value = null;
  vi.unstubAllGlobals();
});

const found = (testid: string) => root.querySelector<HTMLElement>(`[data-testid=${testid}]`);
const show = (servo: KnownServo) => act(() => render(<UndoLine sheet={sheet} one={servo} />, root));

describe("Undo", () => {
  test("is offered while the servo runs on and holds what was written", () => {
    show(one());
    expect(found("undo")).not.toBeNull();
    show(one({ bootAt: 101 }));
    expect(found("undo"), "an uptime is in whole seconds").not.toBeNull();
  });

  test("is gone when the row holds something else", () => {
    show(one());
    act(() => holds(55));
    expect(found("undo-line")).toBeNull();
  });

  test.each<[string, KnownServo]>([
    ["restarts", one({ state: "restarting" })],
    ["came back from a power cut", one({ bootAt: 140 })],
  ])("is gone for good when the servo %s", (_, restarted) => {
    show(one());
    show(restarted);
    expect(found("undo-line")).toBeNull();
    show(one());
    expect(found("undo-line")).toBeNull();
  });

  test("stays while the servo is only offline", () => {
    show(one({ online: false, state: "offline", bootAt: 180 }));
    expect(found("undo")).not.toBeNull();
  });
});

describe("lost RAM values", () => {
  const lost = [{ key: row.key, value: 40, at: 0 }];
  const showLost = (of: Lost) => act(() => render(<LostLine sheet={sheet} one={one({ lost: of })} />, root));

  test("are not spoken of where there are none", () => {
    showLost([]);
    expect(found("lost-line")).toBeNull();
  });

  test("are named, and one press stages them", () => {
    holds(60);
    showLost(lost);
    expect(found("lost-line")?.textContent).toContain("1 value in RAM was lost");
    expect(found("lost-line")?.textContent).toContain("Angle limit CW");
    act(() => found("stage-again")?.click());
    expect(sheet.drafts.get(row.key)?.verdict).toEqual({ ok: true, value: 40 });
    showLost(lost);
    expect((found("stage-again") as HTMLButtonElement).disabled).toBe(true);
    expect(sent).toEqual([]);
  });

  test("can be dismissed", () => {
    showLost(lost);
    act(() => found("lost-dismiss")?.click());
    expect(sent).toEqual([`DELETE /api/v1/servos/${UID}/lost`]);
  });
});
