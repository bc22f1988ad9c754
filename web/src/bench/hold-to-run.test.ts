/** Hold to run: it begins with a press, says so again while it lasts, and whatever ends the press brakes. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { ClientMessage } from "../api/types";
import { brake, held, press, pressByKey, walk, walking } from "./hold-to-run";
import { link, live, type onRefusal } from "./link";
import { endMotion, motion, pace, question, setpoint } from "./motion";

type Refusal = Parameters<Parameters<typeof onRefusal>[0]>[0];
const received = vi.hoisted(() => ({ refuse: new Set<(_: Refusal) => void>() }));
vi.mock("./link", async original => ({
  ...(await original<typeof import("./link")>()),
  onRefusal: (act: (error: Refusal) => void) => {
    received.refuse.add(act);
    return () => received.refuse.delete(act);
  },
}));

const UID = "c".repeat(32);
let sentMessages: ClientMessage[];
let sends: boolean;
let still: boolean;

beforeEach(() => {
  vi.useFakeTimers();
  sentMessages = [];
  sends = true;
  still = true;
  link.value = { state: "up", since: 0 };
  vi.spyOn(live, "send").mockImplementation(message => {
    sentMessages.push(message);
    return sends;
  });
  vi.spyOn(document, "hasFocus").mockReturnValue(true);
  vi.stubGlobal("fetch", async () => new Response("{}"));
  motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
});

afterEach(() => {
  brake();
  motion.value = { phase: "off", why: null };
  vi.useRealTimers();
  vi.restoreAllMocks();
  vi.unstubAllGlobals();
});

const commands = () =>
  sentMessages.flatMap(one =>
    one.type === "command" ? one.commands.map(each => [each.value, each.hold?.renew]) : [],
  );

describe("a held button", () => {
  test("renews the hold eight times a second, and brakes once when released", () => {
    press("speed", 20, () => still);
    vi.advanceTimersByTime(500);
    expect(commands()).toEqual([
      [20, false],
      [20, true],
      [20, true],
      [20, true],
      [20, true],
    ]);
    brake();
    brake();
    vi.advanceTimersByTime(2000);
    expect(commands().slice(5)).toEqual([[0, false]]);
    expect(held.value).toBeNull();
  });

  test.each<[string, () => void]>([
    ["the pointer going up", () => dispatchEvent(new Event("pointerup"))],
    ["the pointer being taken", () => dispatchEvent(new Event("pointercancel"))],
    ["the touch ending", () => dispatchEvent(new Event("touchend"))],
    ["the touch being taken", () => dispatchEvent(new Event("touchcancel"))],
    ["the window losing the focus", () => dispatchEvent(new Event("blur"))],
    ["the page going away", () => dispatchEvent(new Event("pagehide"))],
    ["the tab being hidden", () => document.dispatchEvent(new Event("visibilitychange"))],
    ["the tab being frozen", () => document.dispatchEvent(new Event("freeze"))],
    ["any key going up", () => dispatchEvent(new KeyboardEvent("keyup", { key: "ArrowRight" }))],
    ["another key going down", () => dispatchEvent(new KeyboardEvent("keydown", { key: "Meta" }))],
    [
      "a question",
      () => {
        question.value = { angle: 0, words: [], cautions: [] };
      },
    ],
    [
      "the capture being gone unseen",
      () => {
        still = false;
        vi.advanceTimersByTime(130);
      },
    ],
    [
      "the focus being gone unseen",
      () => {
        vi.spyOn(document, "hasFocus").mockReturnValue(false);
        vi.advanceTimersByTime(130);
      },
    ],
    [
      "a refusal",
      () => {
        for (const act of received.refuse)
          act({ type: "error", seq: 1, code: "busy", detail: "", summary: "", params: {}, uid: UID });
      },
    ],
  ])("is released by %s", (_, end) => {
    press("torque", -10, () => still);
    end();
    expect(held.value).toBeNull();
    expect(commands().at(-1)).toEqual([0, false]);
    question.value = null;
    const before = sentMessages.length;
    vi.advanceTimersByTime(2000);
    expect(sentMessages.length).toBe(before);
  });

  test("repeats of the key change nothing, and do not begin it again after Stop", () => {
    const pad = document.createElement("div");
    const key = (repeat: boolean) => {
      const event = new KeyboardEvent("keydown", { key: "ArrowRight", repeat });
      Object.defineProperty(event, "currentTarget", { value: pad });
      pressByKey(event, "speed", 20);
    };
    key(false);
    key(true);
    expect(commands()).toEqual([[20, false]]);
    endMotion(null);
    expect(held.value).toBeNull();
    motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
    key(true);
    expect(commands()).toEqual([[20, false]]);
  });

  test("a release that cannot be said ends motion, and torque goes another way", () => {
    const requested: string[] = [];
    vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
      requested.push(`${init.method} ${url} ${init.body ?? ""}`);
      return new Response("{}");
    });
    press("speed", 20, () => still);
    sends = false;
    brake();
    expect(motion.value.phase).toBe("off");
    expect(requested).toContain(`POST /api/v1/servos/${UID}/torque {"mode":"off"}`);
  });

  test("nothing begins while motion or torque is off", () => {
    motion.value = { phase: "on", uid: UID, lease: "L", torque: "off", others: [] };
    press("speed", 20, () => still);
    motion.value = { phase: "off", why: null };
    press("speed", 20, () => still);
    expect(sentMessages).toEqual([]);
    expect(held.value).toBeNull();
  });
});

describe("a walk", () => {
  beforeEach(() => {
    setpoint.value = 10;
    pace.value = 60;
  });
  const goals = () => commands().map(([value]) => Number(value));

  test("goes on at its speed while it is held, with nothing ahead that a release would have to take back", () => {
    walk(90, () => still);
    expect(walking.value).toBe(1);
    vi.advanceTimersByTime(1000);
    expect(Math.abs((goals().at(-1) ?? 0) - 70)).toBeLessThan(5);
    const ahead = goals().map((goal, at) => goal - (goals()[at - 1] ?? 10));
    expect(Math.min(...ahead)).toBeGreaterThanOrEqual(0);
    expect(Math.max(...ahead), "a thirtieth of a second").toBeLessThan(5);
    const reported = goals().length;
    brake();
    vi.advanceTimersByTime(2000);
    expect(goals().length - reported, "what waited to be sent").toBeLessThanOrEqual(1);
    expect(walking.value).toBe(0);
    expect(motion.value.phase).toBe("on");
  });

  test("ends at the limit, and does not go back from beyond it", () => {
    walk(-20, () => still);
    vi.advanceTimersByTime(3000);
    expect(goals().at(-1)).toBe(-20);
    expect(Math.min(...goals())).toBe(-20);
    brake();
    setpoint.value = -20;
    walk(-20, () => still);
    expect(walking.value).toBe(0);
  });

  test("begins slowly: a short hold is a short way", () => {
    walk(90, () => still);
    vi.advanceTimersByTime(100);
    brake();
    expect(setpoint.value).toBeGreaterThan(10);
    expect(setpoint.value).toBeLessThan(14);
  });

  test.each<[string, () => void]>([
    ["a button that is not held any more", () => (still = false)],
    ["a lost focus", () => dispatchEvent(new Event("blur"))],
    ["a lost link", () => (link.value = { state: "down", since: 0 })],
    ["motion that ends", () => endMotion(null)],
  ])("ends with %s", (_, happens) => {
    walk(90, () => still);
    vi.advanceTimersByTime(200);
    happens();
    vi.advanceTimersByTime(100);
    const reported = goals().length;
    vi.advanceTimersByTime(1000);
    expect(goals().length).toBe(reported);
    expect(walking.value).toBe(0);
  });
});
