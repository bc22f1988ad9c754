/** What is known of torque after motion: off only when acknowledged, and read until it is. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Problem } from "../api/client";
import type { Reading } from "../api/types";
import { followRelease, forget, forgetConfirmed, released, those } from "./release";

const A = "a".repeat(32);
const B = "b".repeat(32);
const silence = () => Promise.reject(new Problem("no_response", 504, "It did not respond."));
const holds = (value: string) => Promise.resolve({ key: "torque_mode", value } as Reading);
let responses: (() => Response)[];
let requested: string[];

beforeEach(() => {
  vi.useFakeTimers();
  responses = [];
  requested = [];
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    requested.push(`${init.method} ${url}`);
    return responses.shift()?.() ?? new Response('{"code":"no_response"}', { status: 504 });
  });
});

afterEach(() => {
  forget(A);
  forget(B);
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

test("a servo is off when it responds; a silent one is read until it does, and its torque is unknown before", async () => {
  void followRelease(A, holds("off"));
  void followRelease(B, silence());
  expect(those("requesting")).toEqual([A, B]);
  await vi.advanceTimersByTimeAsync(10);
  expect([those("off"), those("silent")]).toEqual([[A], [B]]);
  await vi.advanceTimersByTimeAsync(2500);
  expect(requested).toEqual(Array(2).fill(`GET /api/v1/servos/${B}/parameters/torque_mode`));
  responses = [() => new Response('{"key":"torque_mode","value":"off"}')];
  await vi.advanceTimersByTimeAsync(1000);
  expect(those("off")).toEqual([A, B]);
  await vi.advanceTimersByTimeAsync(5000);
  expect(requested).toHaveLength(3);
});

test("a servo that another client moves by then is dropped", async () => {
  responses = Array(6).fill(() => new Response('{"key":"torque_mode","value":"on"}'));
  void followRelease(A);
  await vi.advanceTimersByTimeAsync(10);
  expect(those("requesting")).toEqual([A]);
  await vi.advanceTimersByTimeAsync(4000);
  expect(released.value.size).toBe(0);
});

test("a new visit forgets confirmed servos, and turning torque on forgets only that servo", async () => {
  void followRelease(A, holds("off"));
  void followRelease(B, silence());
  await vi.advanceTimersByTimeAsync(10);
  forgetConfirmed();
  expect([...released.value]).toEqual([[B, "silent"]]);
  forget(B);
  await vi.advanceTimersByTimeAsync(5000);
  expect(released.value.size).toBe(0);
  expect(requested).toEqual([]);
});
