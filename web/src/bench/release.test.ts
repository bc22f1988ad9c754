/** What is known of torque after motion: off only when the servo said so, and asked until it does. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Problem } from "../api/client";
import type { Reading } from "../api/types";
import { followRelease, forget, forgetAnswered, released, those } from "./release";

const A = "a".repeat(32);
const B = "b".repeat(32);
const silence = () => Promise.reject(new Problem("no_response", 504, "It did not answer."));
const holds = (value: string) => Promise.resolve({ key: "torque_mode", value } as Reading);
let answers: (() => Response)[];
let requested: string[];

beforeEach(() => {
  vi.useFakeTimers();
  answers = [];
  requested = [];
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    requested.push(`${init.method} ${url}`);
    return answers.shift()?.() ?? new Response('{"code":"no_response"}', { status: 504 });
  });
});

afterEach(() => {
  forget(A);
  forget(B);
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

test("who answers is off, who does not is asked until it answers, and nothing is claimed of it before", async () => {
  void followRelease(A, holds("off"));
  void followRelease(B, silence());
  expect(those("asking")).toEqual([A, B]);
  await vi.advanceTimersByTimeAsync(10);
  expect([those("off"), those("silent")]).toEqual([[A], [B]]);
  await vi.advanceTimersByTimeAsync(2500);
  expect(requested).toEqual(Array(2).fill(`GET /api/v1/servos/${B}/parameters/torque_mode`));
  answers = [() => new Response('{"key":"torque_mode","value":"off"}')];
  await vi.advanceTimersByTimeAsync(1000);
  expect(those("off")).toEqual([A, B]);
  await vi.advanceTimersByTimeAsync(5000);
  expect(requested).toHaveLength(3);
});

test("one that is moved by somebody else by then is none of this page's", async () => {
  answers = Array(6).fill(() => new Response('{"key":"torque_mode","value":"on"}'));
  void followRelease(A);
  await vi.advanceTimersByTimeAsync(10);
  expect(those("asking")).toEqual([A]);
  await vi.advanceTimersByTimeAsync(4000);
  expect(released.value.size).toBe(0);
});

test("a new visit forgets who answered, and turning torque on forgets that one alone", async () => {
  void followRelease(A, holds("off"));
  void followRelease(B, silence());
  await vi.advanceTimersByTimeAsync(10);
  forgetAnswered();
  expect([...released.value]).toEqual([[B, "silent"]]);
  forget(B);
  await vi.advanceTimersByTimeAsync(5000);
  expect(released.value.size).toBe(0);
  expect(requested).toEqual([]);
});
