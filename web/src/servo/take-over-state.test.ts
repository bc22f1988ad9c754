/** Take-overs: requested with a countdown, granted with torque off, and never left behind when the page changes. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { TakeOverState } from "../api/types";
import { setLeases } from "../bench/bench";
import { holder } from "../bench/holder";
import { link } from "../bench/link";
import { enableMotion, endMotion, forgetMotion, motion, motionRefusal, startMotion } from "../bench/motion";
import { stopButton } from "../testing/stop-button";
import { forceControl, requestControl } from "./take-over-state";

const UID = "b".repeat(32);
const OTHER = "c".repeat(32);
const held = {
  shown_id: "R",
  holder: "Rig 3",
  uids: null,
  ttl_s: 3,
  expires_at: 0,
  expires_in_s: 3,
  request: null,
};
let sent: string[];
let state: TakeOverState;

startMotion();

let hideStop: () => void;

beforeEach(() => {
  hideStop = stopButton();
  vi.useFakeTimers();
  sent = [];
  link.value = { state: "up", since: 0 };
  setLeases([held]);
  state = { id: "R", by: "us", reason: "", state: "waiting", expires_in_s: 10, lease_id: null, holder: held };
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const path = url.replace("/api/v1", "");
    const lease = (init.headers as Record<string, string>).Lease ? " leased" : "";
    sent.push(`${init.method} ${path}${init.body ? ` ${init.body}` : ""}${lease}`);
    if (path.startsWith("/leases/requests")) return new Response(JSON.stringify(state));
    return new Response(JSON.stringify({ id: "N", value: 0 }));
  });
});

afterEach(async () => {
  hideStop();
  endMotion(null);
  setLeases([]);
  await vi.advanceTimersByTimeAsync(2000);
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const granted = (): TakeOverState => ({ ...state, state: "granted", expires_in_s: 0, lease_id: "N" });
const turn = () => vi.advanceTimersByTimeAsync(1100);
const torque = () => sent.filter(one => one.includes("/torque"));

describe("a request", () => {
  test("names the client and the reason, polls every second, and has torque off when granted", async () => {
    await requestControl(UID, " calibrate ");
    expect(sent[0]).toBe(
      `POST /leases/requests {"holder":"${holder()}","uids":["${UID}"],"ttl_s":3,"reason":"calibrate","timeout_s":10}`,
    );
    expect(motion.value).toMatchObject({ phase: "waiting", from: "Rig 3", request: "R" });
    await turn();
    expect(sent.at(-1)).toBe("GET /leases/requests/R");
    state = granted();
    await turn();
    expect(motion.value).toEqual({ phase: "held", uid: UID, lease: "N" });
    expect(torque(), "nothing is turned on automatically").toEqual([]);
    await enableMotion(UID);
    expect(torque()).toEqual([`POST /servos/${UID}/torque {"mode":"on"} leased`]);
    expect(
      sent.filter(one => one.startsWith("POST /leases {")),
      "the lease is the one granted",
    ).toEqual([]);
    expect(motion.value).toMatchObject({ phase: "on", lease: "N" });
  });

  test("a lease that was granted for one servo is extended to the group that is enabled", async () => {
    state = granted();
    await requestControl(UID, "");
    sent = [];
    await enableMotion(UID, [OTHER]);
    expect(sent).toEqual([
      `PUT /leases/N {"uids":["${UID}","${OTHER}"]}`,
      `POST /servos/${UID}/torque {"mode":"on"} leased`,
      `POST /servos/${OTHER}/torque {"mode":"on"} leased`,
    ]);
  });

  test("the holder who keeps control is the one of this servo", async () => {
    setLeases([
      { ...held, holder: "Rig 4", uids: [OTHER] },
      { ...held, uids: [UID] },
    ]);
    await requestControl(UID, "");
    state = { ...state, state: "refused" };
    await turn();
    expect(motion.value).toEqual({ phase: "off", why: "Rig 3 keeps motion control." });
  });

  test("a rejection names the holder, and ends the requests", async () => {
    await requestControl(UID, "");
    state = { ...state, state: "refused" };
    await turn();
    expect(motion.value).toEqual({ phase: "off", why: "Rig 3 keeps motion control." });
    sent = [];
    await turn();
    expect(sent).toEqual([]);
  });

  test("a cancelled request is withdrawn; a lease granted at that moment is released", async () => {
    await requestControl(UID, "");
    state = granted();
    sent = [];
    forgetMotion(null);
    await turn();
    expect(sent).toEqual(["DELETE /leases/requests/R", "DELETE /leases/N"]);
    expect(motion.value.phase).toBe("off");
  });

  test.each<[string, () => void]>([
    ["a lost link", () => (link.value = { state: "down", since: 0 })],
    ["the page going away", () => dispatchEvent(new Event("pagehide"))],
  ])("%s withdraws", async (_, end) => {
    await requestControl(UID, "");
    sent = [];
    end();
    await turn();
    expect(sent).toContain("DELETE /leases/requests/R");
    expect(motion.value.phase).toBe("off");
  });

  test("what is held and not used is given back when the page goes away, and torque is not touched", async () => {
    state = granted();
    await requestControl(UID, "");
    expect(motion.value.phase).toBe("held");
    sent = [];
    dispatchEvent(new Event("pagehide"));
    await turn();
    expect(sent).toEqual(["DELETE /leases/N"]);
  });
});

describe("taking", () => {
  test("carries the reason, ends in holding, and works while waiting", async () => {
    await requestControl(UID, "");
    await forceControl(UID, "it is about to hit the wing");
    const body = `{"holder":"${holder()}","uids":["${UID}"],"ttl_s":3,"force":true,"reason":"it is about to hit the wing"}`;
    expect(sent.at(-1)).toBe(`POST /leases ${body}`);
    expect(motion.value).toEqual({ phase: "held", uid: UID, lease: "N" });
    expect(motionRefusal.value).toBeNull();
    sent = [];
    await turn();
    expect(
      sent.filter(one => one.startsWith("GET")),
      "the request is no longer polled",
    ).toEqual([]);
  });
});
