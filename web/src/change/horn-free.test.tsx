/** Every dialog that can save asks whether the horn can turn freely, where a restart may turn it; none begins with save. */
import { type ComponentChildren, render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { Problem } from "../api/client";
import type { Forecast, Profile, Restored } from "../api/config-types";
import type { Job, Servo } from "../api/types";
import { openDrift } from "../bench/drift-open";
import { replaceAll } from "../bench/fleet";
import { link } from "../bench/link";
import { ApplyDialog } from "./apply-profile";
import { DriftDialog } from "./drift-dialog";
import { WriteDialog } from "./write-dialog";

const UID = "e".repeat(32);
const OTHER = "f".repeat(32);
const root = document.createElement("div");

const servo = (uid: string) =>
  ({ uid, online: true, model: "BLA21-06U-A0", label: uid[0], unsaved: [], age_s: 0 }) as unknown as Servo;
const change = { key: "angle_p_gain", before: 40, requested: 55, verdict: "planned" };
const plan = { changes: [change], left_out: [], outcome: "planned", job: null } as unknown as Restored;
const TURNS = { moves: true, code: "unknown_start" } as Forecast;
const HOLDS = { moves: false, code: "no_torque" } as Forecast;
/** What the server says that a save does to the horn. */
let restart: Forecast;
const planOf = (save: boolean) => ({ ...plan, restart: save ? restart : null });
const planned = (uids: readonly string[], save: boolean) =>
  ({
    id: "j",
    state: "succeeded",
    steps: [],
    result: {
      servos: uids.map(uid => ({
        uid,
        outcome: "planned",
        changes: [change],
        left_out: [],
        saved: false,
        problem: null,
        restart: save ? restart : null,
      })),
    },
  }) as unknown as Job;
const drift = { rows: [{ key: "angle_p_gain", was: 40, now: 55, proved: true }] };

beforeEach(() => {
  link.value = { state: "up", since: 0 };
  replaceAll([servo(UID), servo(OTHER)]);
  restart = TURNS;
  document.body.append(root);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const body = init.body ? JSON.parse(String(init.body)) : {};
    const answer = url.endsWith("/drift")
      ? drift
      : url.endsWith("/parameters")
        ? planOf(body.save)
        : planned(body.uids, body.save);
    return new Response(JSON.stringify(answer));
  });
});

afterEach(() => {
  openDrift.value = null;
  act(() => render(null, root));
  root.remove();
  vi.unstubAllGlobals();
});

const found = (testid: string) => root.querySelector<HTMLInputElement>(`[data-testid="${testid}"]`);
const press = (testid: string) => act(async () => found(testid)?.click());

/** Ticks Save; the dialog of a profile is asked for its preview once more. */
async function tick(save: string): Promise<void> {
  await press(save);
  await act(async () => new Promise(resolve => setTimeout(resolve, 2)));
  if (save === "apply-save") {
    expect(found("apply-confirm")?.disabled, "what was planned was without a save").toBe(true);
    await press("apply-preview");
    await act(async () => undefined);
  }
}

async function show(children: ComponentChildren): Promise<void> {
  await act(async () => render(children, root));
  await act(async () => undefined);
}

const profile = { name: "Elevator", values: {}, model: null } as unknown as Profile;
const close = () => undefined;
const DIALOGS = [
  ["restore of a snapshot", "write-save", "write-confirm", () => show(<Write />)],
  ["what was changed outside", "drift-save", "drift-restore", showDrift],
  ["profile", "apply-save", "apply-confirm", showProfile],
] as const;

function Write() {
  return (
    <WriteDialog
      uid={UID}
      name="Gripper"
      write={async wish => planOf(wish.save)}
      onClose={close}
      onRefused={close}
    />
  );
}

function Drift() {
  openDrift.value = UID;
  return <DriftDialog />;
}

/** What it differs in is read first, then asked about. */
async function showDrift(): Promise<void> {
  await show(<Drift />);
  await act(async () => new Promise(resolve => setTimeout(resolve, 2)));
}

async function showProfile(): Promise<void> {
  await show(<ApplyDialog one={profile} uids={[UID]} onClose={close} />);
  await press("apply-preview");
  await act(async () => undefined);
}

describe.each(DIALOGS)("%s", (_, save, go, open) => {
  test("does not begin with save; with it, the horn is asked about, and the button waits for the answer", async () => {
    await open();
    expect(found(save)?.checked).toBe(false);
    expect(found("horn-free")).toBeNull();
    expect(found(go)?.disabled).toBe(false);
    await tick(save);
    expect(found("after-save")?.textContent).toContain("moves to 0.0°");
    expect(found(go)?.disabled).toBe(true);
    await press("horn-free");
    expect(found(go)?.disabled).toBe(false);
  });

  test("does not ask where the restart turns nothing", async () => {
    restart = HOLDS;
    await open();
    await tick(save);
    expect(found("after-save")?.textContent).toContain("torque off");
    expect(found("horn-free")).toBeNull();
    expect(found(go)?.disabled).toBe(false);
  });
});

test("a yes for one horn is none for another", async () => {
  await showProfile();
  await tick("apply-save");
  await press("horn-free");
  expect(found("apply-confirm")?.disabled).toBe(false);
  await act(async () => found(`apply-${OTHER}`)?.querySelector("input")?.click());
  await press("apply-preview");
  await act(async () => undefined);
  expect(found("horn-free")?.checked).toBe(false);
  expect(found("apply-confirm")?.disabled).toBe(true);
});

describe("a refused dry run", () => {
  test("keeps the dialog of a restore from opening, and says why", async () => {
    const refused = vi.fn();
    const write = () => Promise.reject(new Problem("stopped", 423, "Stopped."));
    await show(<WriteDialog uid={UID} name="Gripper" write={write} onClose={close} onRefused={refused} />);
    expect(found("write-dialog")).toBeNull();
    expect(refused).toHaveBeenCalledExactlyOnceWith(expect.stringContaining("clear the stop first"));
  });

  test("that only wants a yes opens it with the question", async () => {
    const write = () => Promise.reject(new Problem("needs_confirmation", 409, "?", { confirm: "supply" }));
    await show(<WriteDialog uid={UID} name="Gripper" write={write} onClose={close} onRefused={close} />);
    expect(found("write-dialog")?.textContent).toContain("I checked the supply");
    expect(found("write-confirm")).toBeNull();
  });
});
