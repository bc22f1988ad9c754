/** Every dialog that can save requires a free horn if a restart may turn it; none begins with save. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Forecast, Profile, Restored } from "../api/config-types";
import type { Job, Servo } from "../api/types";
import { replaceAll } from "../bench/fleet";
import { link } from "../bench/link";
import { ChangeDialog } from "./dialog";
import { beginChange, openChange, shownChange } from "./flow";
import { openDrift, profileChange, snapshotChange } from "./requests";

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
let refused: { code: string; status: number; detail: string; confirm?: string } | null;
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
  refused = null;
  document.body.append(root);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const body = init.body ? JSON.parse(String(init.body)) : {};
    if (refused) return new Response(JSON.stringify(refused), { status: refused.status });
    const response = url.endsWith("/drift")
      ? drift
      : url.endsWith("/parameters") || url.endsWith("/restore")
        ? planOf(body.save)
        : planned(body.uids, body.save);
    return new Response(JSON.stringify(response));
  });
});

afterEach(() => {
  shownChange.value = null;
  act(() => render(null, root));
  root.remove();
  vi.unstubAllGlobals();
});

const found = (testid: string) => root.querySelector<HTMLInputElement>(`[data-testid="${testid}"]`);
const press = (testid: string) => act(async () => found(testid)?.click());

/** Check Save: that is a different change, so it is planned again. */
async function tick(): Promise<void> {
  await press("change-save");
  await act(async () => new Promise(resolve => setTimeout(resolve, 2)));
}

async function show(open: () => unknown): Promise<void> {
  await act(async () => render(<ChangeDialog />, root));
  await act(async () => void (await open()));
  await act(async () => new Promise(resolve => setTimeout(resolve, 2)));
}

const profile = { name: "Elevator", values: {}, model: null } as unknown as Profile;
const snapshot = () => beginChange(snapshotChange(UID, 1, null, () => undefined));
const DIALOGS = [
  ["restore of a snapshot", "snapshot-go", () => show(snapshot)],
  ["what another tool changed", "drift-go", () => show(() => openDrift(UID))],
  ["profile", "profile-go", showProfile],
] as const;

async function showProfile(): Promise<void> {
  await show(() => openChange(profileChange(profile, [UID])));
  await preview();
}

async function preview(): Promise<void> {
  await press("change-again");
  await act(async () => undefined);
}

describe.each(DIALOGS)("%s", (_, go, open) => {
  test("does not begin with save; with it, the button waits for the confirmation of the horn", async () => {
    await open();
    expect(found("change-save")?.checked).toBe(false);
    expect(found("horn-free")).toBeNull();
    expect(found(go)?.disabled).toBe(false);
    await tick();
    expect(found("after-save")?.textContent).toContain("moves to 0.0°");
    expect(found(go)?.disabled).toBe(true);
    await press("horn-free");
    expect(found(go)?.disabled).toBe(false);
  });

  test("needs no confirmation if the restart turns nothing", async () => {
    restart = HOLDS;
    await open();
    await tick();
    expect(found("after-save")?.textContent).toContain("torque off");
    expect(found("horn-free")).toBeNull();
    expect(found(go)?.disabled).toBe(false);
  });
});

test("a yes for one horn is none for another", async () => {
  await showProfile();
  await tick();
  await press("horn-free");
  expect(found("profile-go")?.disabled).toBe(false);
  await act(async () => found(`apply-${OTHER}`)?.querySelector("input")?.click());
  expect(found("profile-go"), "what was planned was another change").toBeNull();
  await preview();
  expect(found("horn-free")?.checked).toBe(false);
  expect(found("profile-go")?.disabled).toBe(true);
});

describe("a refused dry run", () => {
  test("keeps the dialog of a restore from opening, and says why", async () => {
    refused = { code: "stopped", status: 423, detail: "Stopped." };
    await show(() => undefined);
    await act(async () => expect(await snapshot()).toContain("Clear the stop first"));
    expect(found("snapshot-dialog")).toBeNull();
  });

  test("that only wants a yes opens it with the question", async () => {
    refused = { code: "needs_confirmation", status: 409, detail: "?", confirm: "supply" };
    await show(snapshot);
    expect(found("snapshot-dialog")?.textContent).toContain("I checked the supply");
    expect(found("snapshot-go")).toBeNull();
    expect(found("change-again")?.disabled).toBe(true);
    refused = null;
    await press("confirm-supply");
    await press("change-again");
    await act(async () => new Promise(resolve => setTimeout(resolve, 2)));
    expect(found("snapshot-go")?.disabled).toBe(false);
    await press("confirm-supply");
    expect(found("snapshot-go"), "a word that is taken back").toBeNull();
  });
});
