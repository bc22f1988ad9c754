/** Motion: it begins only on request, and everything that ends it turns torque off and gives the lease back. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Stop } from "../api/types";
import { stopButton } from "../testing/stop-button";
import { leases, setLeases, stop } from "./bench";
import { holder, isOurs } from "./holder";
import { link, live, type onRefusal } from "./link";
import {
  dragTo,
  enableMotion,
  endMotion,
  isOfOther,
  keepMotion,
  leaseFor,
  leaseOfOther,
  type MotionQuestion,
  membersOf,
  motion,
  motionRefusal,
  moveTo,
  pace,
  question,
  setpoint,
  setTorque,
  startMotion,
  type Together,
  warnings,
} from "./motion";
import { forget, those } from "./release";

type Refusal = Parameters<Parameters<typeof onRefusal>[0]>[0];
const received = vi.hoisted(() => ({ refuse: (_: Refusal): void => undefined }));
vi.mock("./link", async original => ({
  ...(await original<typeof import("./link")>()),
  onRefusal: (act: (error: Refusal) => void) => {
    received.refuse = act;
  },
}));

const UID = "b".repeat(32);
const LEASE = { uids: [UID], ttl_s: 3, expires_at: 0, expires_in_s: 3, request: null };
let sent: string[];
let hideStop: () => void;
let fail: { path: RegExp; status: number; body: unknown } | null;

startMotion();

beforeEach(() => {
  sent = [];
  fail = null;
  link.value = { state: "up", since: 0 };
  stop.value = null;
  hideStop = stopButton();
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const path = url.replace("/api/v1", "");
    const body = init.body ? ` ${init.body}` : "";
    const lease = (init.headers as Record<string, string>).Lease ? " leased" : "";
    sent.push(`${init.method} ${path}${body}${lease}`);
    if (fail?.path.test(`${init.method} ${path}`)) {
      return new Response(JSON.stringify(fail.body), { status: fail.status });
    }
    if (path === "/leases") {
      setLeases([{ ...LEASE, shown_id: "L", holder: holder() }]);
      return new Response(
        JSON.stringify({ id: "L", holder: holder(), ttl_s: 3, expires_at: 0, expires_in_s: 3 }),
      );
    }
    if (path.includes("/cautions")) {
      const caution = { level: "warning", text: "It would turn twice.", confirm: "turns" };
      const other = { level: "warning", text: "It has a PWM input.", confirm: null };
      return new Response(JSON.stringify([caution, other]));
    }
    const warnings = ["It has a PWM input."];
    return new Response(JSON.stringify({ value: 12, clamped: false, warnings }));
  });
});

afterEach(async () => {
  endMotion(null);
  setLeases([]);
  hideStop();
  await settle();
  forget(UID);
  vi.unstubAllGlobals();
});

const settle = () => new Promise(resolve => setTimeout(resolve, 5));
const torqueOff = `POST /servos/${UID}/torque {"mode":"off"} leased`;

describe("motion", () => {
  test("takes the lease first, then turns torque on under it, and sends no command", async () => {
    await enableMotion(UID);
    expect(sent).toHaveLength(2);
    expect(sent[0]).toMatch(/^POST \/leases .*"ttl_s":3/);
    expect(sent[1]).toBe(`POST /servos/${UID}/torque {"mode":"on"} leased`);
    expect(motion.value).toMatchObject({ phase: "on", uid: UID });
  });

  test("does not begin where Stop is not seen whole, and says why and what to do", async () => {
    hideStop();
    hideStop = stopButton({ left: 900, top: 0, right: 1084, bottom: 64 });
    await enableMotion(UID);
    expect(sent).toEqual([]);
    expect(motion.value.phase).toBe("off");
    expect(motionRefusal.value).toBe(
      "Stop is not fully visible in this window. Enlarge the window or zoom out, then enable motion.",
    );
  });

  test("ends when Stop is out of sight for longer than a window takes to change its size", async () => {
    await enableMotion(UID);
    vi.useFakeTimers();
    hideStop();
    hideStop = stopButton({ left: 900, top: 0, right: 1084, bottom: 64 });
    await vi.advanceTimersByTimeAsync(200);
    expect(motion.value.phase).toBe("on");
    await vi.advanceTimersByTimeAsync(200);
    vi.useRealTimers();
    expect(motion.value).toEqual({ phase: "off", why: "Motion ended: Stop was no longer fully visible." });
    expect(sent).toContain(torqueOff);
  });

  test("goes on where Stop was out of sight for a moment", async () => {
    await enableMotion(UID);
    vi.useFakeTimers();
    hideStop();
    hideStop = stopButton();
    await vi.advanceTimersByTimeAsync(1000);
    vi.useRealTimers();
    expect(motion.value.phase).toBe("on");
  });

  test("a lease in other hands is said, with holder and seconds; torque is not touched", async () => {
    const body = {
      code: "lease_held",
      detail: "",
      summary: "",
      title: "",
      type: "",
      status: 409,
      holder: "Rig 3",
      expires_in_s: 17.2,
    };
    fail = { path: /POST \/leases/, status: 409, body };
    await enableMotion(UID);
    expect(motionRefusal.value).toBe("Rig 3 has motion control for 18\u202fs more. Request it, or wait.");
    expect(motion.value.phase).toBe("off");
    expect(sent).toHaveLength(1);
  });

  test("if torque cannot go on, the lease is given back", async () => {
    const body = {
      code: "no_response",
      detail: "It did not respond.",
      summary: "It did not respond.",
      title: "",
      type: "",
      status: 504,
    };
    fail = { path: /torque/, status: 504, body };
    await enableMotion(UID);
    expect(motion.value.phase).toBe("off");
    expect(motionRefusal.value).toBe("It did not respond.");
    expect(sent).toContain("DELETE /leases/L");
    await settle();
    expect(those("silent"), "it may have received the command").toEqual([UID]);
  });

  test.each<[string, () => void]>([
    ["the button", () => endMotion(null)],
    ["the page going away", () => dispatchEvent(new Event("pagehide"))],
    [
      "the tab being hidden",
      () => {
        vi.spyOn(document, "hidden", "get").mockReturnValue(true);
        document.dispatchEvent(new Event("visibilitychange"));
      },
    ],
    [
      "the link being lost",
      () => {
        link.value = { state: "down", since: 0 };
      },
    ],
  ])("%s ends it: torque off, lease back", async (_, end) => {
    await enableMotion(UID);
    sent = [];
    end();
    await settle();
    expect(motion.value.phase).toBe("off");
    expect(sent).toContain(torqueOff);
    expect(sent).toContain("DELETE /leases/L");
  });

  test("a servo of a group that does not respond is named, and the others count as off", async () => {
    const other = "c".repeat(32);
    const begin = async () => undefined;
    await enableMotion(UID, [other], { begin } as unknown as Together);
    const body = {
      code: "no_response",
      detail: "C did not respond.",
      summary: "C did not respond.",
      title: "",
      type: "",
      status: 504,
    };
    fail = { path: new RegExp(`${other}/torque`), status: 504, body };
    await setTorque("off");
    expect(motion.value).toMatchObject({ phase: "on", torque: "off" });
    expect(motionRefusal.value).toBe("C did not respond.");
    expect([those("off"), those("silent")]).toEqual([[UID], [other]]);
    forget(other);
  });

  test("a stop ends it; nothing is commanded after", async () => {
    await enableMotion(UID);
    stop.value = { latched: true, servos: [] } as unknown as Stop;
    expect(motion.value).toEqual({ phase: "off", why: "Motion ended: Stop." });
    await settle();
    sent = [];
    await moveTo(10);
    expect(sent).toEqual([]);
    expect(setpoint.value).toBeNull();
  });

  test("a command goes out under the lease, and shows what was really sent", async () => {
    await enableMotion(UID);
    sent = [];
    await moveTo(30);
    expect(sent).toEqual([
      `POST /servos/${UID}/command {"type":"angle","value":30,"profile":{"speed_deg_s":60,"accel_deg_s2":240}} leased`,
    ]);
    expect(setpoint.value).toBe(12);
    pace.value = null;
    sent = [];
    await moveTo(31);
    expect(sent, "direct has no profile").toEqual([
      `POST /servos/${UID}/command {"type":"angle","value":31} leased`,
    ]);
    pace.value = 60;
  });

  test("a move that needs confirmation shows the cautions, and is sent again only with the confirmations", async () => {
    await enableMotion(UID);
    const body = {
      code: "needs_confirmation",
      detail: "Send it again.",
      summary: "Send it again.",
      title: "",
      type: "",
      status: 409,
    };
    fail = { path: /command$/, status: 409, body: { ...body, confirm: "turns", words: ["turns"] } };
    await moveTo(720);
    expect(sent.at(-1)).toBe(`GET /servos/${UID}/cautions?type=angle&value=720`);
    expect(question.value).toEqual({ angle: 720, words: ["turns"], cautions: ["It would turn twice."] });
    expect(motionRefusal.value).toBeNull();
    expect(setpoint.value, "the ghost stands where the last command was").not.toBe(720);
    fail = null;
    const requested = question.value as MotionQuestion;
    await moveTo(requested.angle, requested.words);
    expect(sent.at(-1)).toMatch(/"value":720,.*"confirm":\["turns"\]} leased$/);
    expect(question.value).toBeNull();
    expect(warnings.value).toEqual(["It has a PWM input."]);
    endMotion(null);
    expect(warnings.value).toEqual([]);
  });

  test("a drag that needs confirmation opens one dialog, and pauses until then", async () => {
    const sendSpy = vi.spyOn(live, "send").mockReturnValue(true);
    await enableMotion(UID);
    const body = {
      code: "needs_confirmation",
      detail: "Send it again.",
      summary: "Send it again.",
      title: "",
      type: "",
      status: 409,
    };
    fail = { path: /command$/, status: 409, body: { ...body, confirm: "turns", words: ["turns"] } };
    dragTo(40);
    const error = {
      type: "error",
      seq: 1,
      code: "needs_confirmation",
      detail: "Send it again.",
      summary: "Send it again.",
      params: {},
    } as const;
    received.refuse({ ...error, uid: UID });
    await settle();
    expect(question.value).toMatchObject({ angle: 40, words: ["turns"] });
    expect(motionRefusal.value).toBeNull();
    sent = [];
    sendSpy.mockClear();
    dragTo(50);
    received.refuse({ ...error, uid: UID });
    await settle();
    expect(sent).toEqual([]);
    expect(sendSpy).not.toHaveBeenCalled();
  });

  test("a request for motion control is rejected, or granted by torque off and release of the lease", async () => {
    await enableMotion(UID);
    sent = [];
    await keepMotion("ab12");
    expect(sent).toEqual(["POST /leases/requests/ab12/refuse leased"]);
    expect(motion.value.phase).toBe("on");
    endMotion("handed over");
    await settle();
    expect(sent).toContain(torqueOff);
    expect(sent).toContain("DELETE /leases/L");
  });

  test("a request cancelled before its response turns no torque on, also after a new request", async () => {
    const usual = fetch;
    const other = "d".repeat(32);
    let late: (response: Response) => void = () => undefined;
    let requested = 0;
    vi.stubGlobal("fetch", (url: string, init: RequestInit) => {
      if (!url.endsWith("/leases") || requested++ > 0) return usual(url, init);
      return new Promise<Response>(resolve => {
        late = resolve;
      });
    });
    const sendSpy = vi.spyOn(live, "send").mockReturnValue(true);
    const first = enableMotion(other);
    endMotion(null);
    const second = enableMotion(UID);
    late(
      new Response(
        JSON.stringify({ id: "late", holder: holder(), ttl_s: 3, expires_at: 0, expires_in_s: 3 }),
      ),
    );
    await first;
    await second;
    expect(motion.value).toMatchObject({ phase: "on", uid: UID, lease: "L" });
    expect(sent).toContain("DELETE /leases/late");
    expect(sent.filter(one => one.includes(other) && one.includes('"on"'))).toEqual([]);
    expect(sendSpy.mock.calls.flat()).not.toContainEqual({ type: "heartbeat", lease: "late" });
  });

  test("a lease is ours by its ID: a copy of this tab with the same name is another client", async () => {
    const sendSpy = vi.spyOn(live, "send").mockReturnValue(true);
    await enableMotion(UID);
    const ours = leases.value[0];
    if (!ours) throw new Error("no lease");
    expect([isOurs(ours), isOfOther(ours)]).toEqual([true, false]);
    sendSpy.mockClear();
    setLeases([{ ...ours, shown_id: "twin" }]);
    expect(sendSpy.mock.calls).toEqual([[{ type: "heartbeat", lease: "L" }]]);
    expect(isOfOther({ ...ours, shown_id: "twin" })).toBe(true);
    endMotion(null);
    expect(isOfOther(ours), "given back, and shown a moment longer").toBe(false);
    expect(isOfOther({ ...ours, shown_id: "twin" })).toBe(true);
  });

  test("the lease passing to another client is checked, not guessed", async () => {
    const sendSpy = vi.spyOn(live, "send").mockReturnValue(true);
    await enableMotion(UID);
    sendSpy.mockClear();
    sent = [];
    setLeases([]);
    expect(sendSpy.mock.calls).toEqual([[{ type: "heartbeat", lease: "L" }]]);
    expect(motion.value.phase).toBe("on");
    // The response to the heartbeat of an ended lease; its new holder is published a moment later.
    vi.useFakeTimers();
    received.refuse({
      type: "error",
      seq: 1,
      code: "unknown_lease",
      detail: "This lease has ended.",
      summary: "This lease has ended.",
      params: {},
      uid: null,
    });
    const why = "Motion ended: motion control was lost.";
    expect(motion.value).toEqual({ phase: "off", why });
    setLeases([{ ...LEASE, shown_id: "R", holder: "Rig 3" }]);
    vi.advanceTimersByTime(700);
    vi.useRealTimers();
    const taken = "Motion ended: Rig 3 took motion control.";
    expect(motion.value).toEqual({ phase: "off", why: taken });
    const requested = [`GET /servos/${UID}/parameters/torque_mode`];
    expect(sent, "what is gone is not given back, and what became of torque is read").toEqual(requested);
  });
});

describe("a lease covers what this page moves, beside those of other clients", () => {
  const other = "c".repeat(32);
  const rig = { ...LEASE, shown_id: "R", holder: "Rig 3", uids: [other] };

  test("it is taken for these servos only, and the lease of another servo does not end it", async () => {
    setLeases([rig]);
    await enableMotion(UID);
    expect(sent[0]).toContain(`"uids":["${UID}"]`);
    setLeases([rig, { ...LEASE, shown_id: "L", holder: holder() }]);
    expect([leaseOfOther(UID), leaseOfOther(other)?.holder]).toEqual([null, "Rig 3"]);
    expect(motion.value.phase).toBe("on");
  });

  test("what ended it is the lease that covers its servo, not that of another servo", async () => {
    await enableMotion(UID);
    setLeases([rig]);
    const error = {
      type: "error",
      seq: 1,
      code: "unknown_lease",
      detail: "",
      summary: "",
      params: {},
    } as const;
    received.refuse({ ...error, uid: null });
    expect(motion.value).toEqual({ phase: "off", why: "Motion ended: motion control was lost." });
    setLeases([rig, { ...LEASE, shown_id: "S", holder: "Rig 4" }]);
    expect(motion.value).toEqual({ phase: "off", why: "Motion ended: Rig 4 took motion control." });
  });

  test("a lease of all servos covers every servo", () => {
    setLeases([{ ...rig, uids: null }]);
    expect([leaseOfOther(UID)?.holder, leaseOfOther(other)?.holder]).toEqual(["Rig 3", "Rig 3"]);
  });
});

describe("the lease for a measurement", () => {
  const other = "c".repeat(32);

  test("is taken with torque on if motion is off, and is then the same", async () => {
    expect(await leaseFor(UID)).toBe("L");
    expect(sent.map(one => one.split(" ")[1])).toEqual(["/leases", `/servos/${UID}/torque`]);
    expect(await leaseFor(UID)).toBe("L");
    expect(sent).toHaveLength(2);
  });

  test("covers other servos, also those that are added later", async () => {
    await leaseFor(UID);
    expect(await leaseFor(UID, [other])).toBe("L");
    expect(membersOf(motion.value)).toEqual([UID, other]);
    expect(sent.slice(-2)).toEqual([
      `PUT /leases/L {"uids":["${other}"]}`,
      `POST /servos/${other}/torque {"mode":"on"} leased`,
    ]);
  });

  test("is refused with the reason, and nothing stays on", async () => {
    fail = { path: /POST \/servos/, status: 409, body: { code: "busy", detail: "The servo is busy." } };
    await expect(leaseFor(UID)).rejects.toThrow("The servo is busy.");
    expect(motion.value.phase).toBe("off");
    await settle();
    expect(sent.some(one => one.startsWith("DELETE /leases/L"))).toBe(true);
  });

  test("is refused while Stop is hidden, and while motion is on for another servo", async () => {
    await leaseFor(UID);
    await expect(leaseFor(other)).rejects.toThrow();
    endMotion(null);
    sent.length = 0;
    hideStop();
    await expect(leaseFor(UID)).rejects.toThrow();
    expect(sent.filter(one => one.startsWith("POST /leases"))).toEqual([]);
  });
});
