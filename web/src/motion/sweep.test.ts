/** A sweep: its command is abandoned when it ends, however it ends. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { motion } from "../bench/motion";
import { endSweep, startSweep, sweep, sweepResult } from "./sweep";

const UID = "c".repeat(32);
let commands: AbortSignal[];

beforeEach(() => {
  commands = [];
  motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
  vi.stubGlobal("fetch", (url: string, { signal }: { signal: AbortSignal }) => {
    if (url.endsWith("/command")) commands.push(signal);
    return new Promise((_, reject) => signal.addEventListener("abort", () => reject(signal.reason)));
  });
});

afterEach(() => {
  vi.unstubAllGlobals();
  motion.value = { phase: "off", why: null };
});

test.each([
  ["its button", () => void endSweep(), "holds its position"],
  ["the end of motion", () => (motion.value = { phase: "off", why: null }), "motion was interrupted"],
])("ends with %s", async (_, end, result) => {
  const ended = startSweep({ from: -10, to: 10, speed: 60, pause_s: 0, count: 2 });
  expect(commands.map(one => one.aborted)).toEqual([false]);
  end();
  expect(
    commands.map(one => one.aborted),
    "no command arrives later",
  ).toEqual([true]);
  await ended;
  expect(sweep.value).toBeNull();
  expect(sweepResult.value).toContain(result);
  expect(commands).toHaveLength(1);
});
