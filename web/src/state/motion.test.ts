/** Motion: it begins only when asked, and everything that ends it turns torque off and gives the lease back. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Stop } from "../api/types";
import { setLease, stop } from "./desk";
import { link } from "./link";
import { enableMotion, endMotion, holder, motion, moveTo, refusal, setpoint, startMotion } from "./motion";

const UID = "b".repeat(32);
let sent: string[];
let fail: { path: RegExp; status: number; body: unknown } | null;

startMotion();

beforeEach(() => {
  sent = [];
  fail = null;
  link.value = { state: "up", since: 0 };
  stop.value = null;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const path = url.replace("/api/v1", "");
    const body = init.body ? ` ${init.body}` : "";
    const lease = (init.headers as Record<string, string>).Lease ? " leased" : "";
    sent.push(`${init.method} ${path}${body}${lease}`);
    if (fail?.path.test(`${init.method} ${path}`)) {
      return new Response(JSON.stringify(fail.body), { status: fail.status });
    }
    if (path === "/leases") {
      setLease({ holder: holder(), ttl_s: 3, expires_at: 0, expires_in_s: 3 });
      return new Response(
        JSON.stringify({ id: "L", holder: holder(), ttl_s: 3, expires_at: 0, expires_in_s: 3 }),
      );
    }
    return new Response(JSON.stringify({ value: 12, clamped: false }));
  });
});

afterEach(async () => {
  endMotion(null);
  setLease(null);
  await settle();
  vi.unstubAllGlobals();
});

const settle = () => new Promise(resolve => setTimeout(resolve, 5));
const torqueOff = `POST /servos/${UID}/torque {"mode":"off"}`;

describe("motion", () => {
  test("takes the lease first, then turns torque on under it, and sends no command", async () => {
    await enableMotion(UID);
    expect(sent).toHaveLength(2);
    expect(sent[0]).toMatch(/^POST \/leases .*"ttl_s":3/);
    expect(sent[1]).toBe(`POST /servos/${UID}/torque {"mode":"on"} leased`);
    expect(motion.value).toMatchObject({ phase: "on", uid: UID });
  });

  test("a lease in other hands is said, with holder and seconds; torque is not touched", async () => {
    const body = {
      code: "lease_held",
      detail: "",
      title: "",
      type: "",
      status: 409,
      holder: "Rig 3",
      expires_in_s: 17.2,
    };
    fail = { path: /POST \/leases/, status: 409, body };
    await enableMotion(UID);
    expect(refusal.value).toBe("Rig 3 has motion control for 18\u202fs more. Ask for it, or wait.");
    expect(motion.value.phase).toBe("off");
    expect(sent).toHaveLength(1);
  });

  test("if torque cannot go on, the lease is given back", async () => {
    const body = { code: "no_answer", detail: "It did not answer.", title: "", type: "", status: 504 };
    fail = { path: /torque/, status: 504, body };
    await enableMotion(UID);
    expect(motion.value.phase).toBe("off");
    expect(refusal.value).toBe("It did not answer.");
    expect(sent).toContain("DELETE /leases/L");
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

  test("a stop ends it; nothing is commanded after", async () => {
    await enableMotion(UID);
    stop.value = { latched: true, servos: [] } as unknown as Stop;
    expect(motion.value).toEqual({ phase: "off", why: "Motion ended: stopped." });
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
    expect(sent).toEqual([`POST /servos/${UID}/command {"type":"angle","value":30} leased`]);
    expect(setpoint.value).toBe(12);
  });

  test("the lease passing to somebody else is checked, not guessed", async () => {
    await enableMotion(UID);
    sent = [];
    setLease(null);
    await settle();
    expect(sent).toEqual(["PUT /leases/L"]);
    expect(motion.value.phase).toBe("on");
    fail = {
      path: /PUT \/leases/,
      status: 404,
      body: { code: "unknown_lease", detail: "This lease has ended.", title: "", type: "", status: 404 },
    };
    setLease({ holder: "Rig 3", ttl_s: 3, expires_at: 0, expires_in_s: 3 });
    await settle();
    expect(motion.value).toEqual({ phase: "off", why: "Motion ended: This lease has ended." });
  });
});
