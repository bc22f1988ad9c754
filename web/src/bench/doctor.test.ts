/** The doctor's findings: the worst first, counted for the rail, and old ones kept when a look fails. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Finding, FindingCode } from "../api/bus-types";
import { complaints, doctor, findings, findingsInOrder, watchDoctor } from "./doctor";
import { link } from "./link";
import type { Poll } from "./poll";

const finding = (code: string, severity: Finding["severity"]): Finding => ({
  code: code as FindingCode,
  severity,
  text: code,
  evidence: "",
  remedy: null,
  advice: null,
  params: {},
  node_ids: [],
  uids: [],
});

describe("inOrder", () => {
  test("failures, warnings, notices, then what is well; among equals as they came", () => {
    const list = [
      finding("a", "ok"),
      finding("b", "warning"),
      finding("c", "failure"),
      finding("d", "notice"),
      finding("e", "warning"),
      finding("f", "failure"),
    ];
    expect(findingsInOrder(list).map(one => one.code)).toEqual(["c", "f", "b", "e", "d", "a"]);
    expect(list[0]?.code).toBe("a");
  });
});

describe("watchDoctor", () => {
  let responses: (() => Response)[];
  let requested: string[];
  let watch: Poll;

  const response = (list: Finding[]) => () => new Response(JSON.stringify(list));

  beforeEach(() => {
    vi.useFakeTimers();
    link.value = { state: "up", since: 0 };
    requested = [];
    vi.stubGlobal("fetch", async (url: string) => {
      requested.push(url);
      const next = responses.shift();
      if (!next) throw new TypeError("refused");
      return next();
    });
  });

  afterEach(() => {
    watch.end();
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  test("polls at once and every three seconds, including healthy conditions, and stops when it ends", async () => {
    responses = [
      response([finding("load", "ok"), finding("loss", "failure")]),
      response([finding("load", "ok")]),
    ];
    watch = watchDoctor();
    await vi.advanceTimersByTimeAsync(10);
    expect(requested).toEqual(["/api/v1/bus/doctor?all=true"]);
    expect(findings.value.map(one => one.code)).toEqual(["loss", "load"]);
    expect(complaints.value).toEqual({ failure: 1, warning: 0 });
    await vi.advanceTimersByTimeAsync(3000);
    expect(findings.value.map(one => one.code)).toEqual(["load"]);
    expect(complaints.value).toEqual({ failure: 0, warning: 0 });
    watch.end();
    await vi.advanceTimersByTimeAsync(10_000);
    expect(requested).toHaveLength(2);
  });

  test("a look that fails says so and leaves the last findings with their time", async () => {
    responses = [response([finding("loss", "warning")])];
    watch = watchDoctor();
    await vi.advanceTimersByTimeAsync(10);
    const at = doctor.readAt.value;
    await vi.advanceTimersByTimeAsync(3000);
    expect(doctor.problem.value).toContain("hornbill does not respond");
    expect(findings.value).toHaveLength(1);
    expect(doctor.readAt.value).toBe(at);
  });

  test("sends no request without a link, and one at once when it is back", async () => {
    link.value = { state: "down", since: 0 };
    responses = [response([])];
    watch = watchDoctor();
    await vi.advanceTimersByTimeAsync(7000);
    expect(requested).toEqual([]);
    link.value = { state: "up", since: 7 };
    await vi.advanceTimersByTimeAsync(10);
    expect(requested).toHaveLength(1);
  });
});
