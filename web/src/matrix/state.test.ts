/** The matrix: who stands out, what may be staged on whom, and what goes out. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Reading, Row } from "../api/types";
import { sheetOf } from "../bench/parameters";
import { stagedOn, writeMatrix } from "../change/requests";
import { draftFor, stageValue } from "../change/stage";
import { copyOf, type HeldValue, outliers, uidsIn } from "./state";

const A = "a".repeat(32);
const B = "b".repeat(32);

const held = (uid: string, value: HeldValue["value"], model: string | null = "M", unit = "°"): HeldValue => ({
  uid,
  model,
  value,
  unit,
});

describe("oddOnes", () => {
  test("one that holds something else than most of its model stands out, with what they hold", () => {
    const odd = outliers([held("1", 60), held("2", 60), held("3", 75)]);
    expect([...odd]).toEqual([["3", { kind: "outlier", usual: 60, unit: "°" }]]);
  });

  test("two that differ are apart: neither is the one that is wrong", () => {
    const odd = outliers([held("1", 60), held("2", 75)]);
    expect([...odd.values()]).toEqual([{ kind: "apart" }, { kind: "apart" }]);
  });

  test("models are not compared with one another, nor is what was never read", () => {
    expect(outliers([held("1", 60), held("2", 75, "N")]).size).toBe(0);
    expect(outliers([held("1", 60), held("2", undefined), held("3", null)]).size).toBe(0);
    expect(outliers([held("1", 60), held("2", 60), held("3", 75, null)]).size).toBe(0);
  });

  test("the same number in another unit is another value", () => {
    const odd = outliers([held("1", 5), held("2", 5), held("3", 5, "M", "rpm")]);
    expect(odd.get("3")?.kind).toBe("outlier");
  });
});

test("an address names its servos once each, and nothing that is no unique id", () => {
  expect(uidsIn(`${A},${B},${A},nonsense`)).toEqual([A, B]);
  expect(uidsIn("")).toEqual([]);
});

const row = (key: string, more: Partial<Row> = {}) =>
  ({
    key,
    name: "0x38",
    label: key,
    kind: "number",
    unit: "°",
    per_unit: 10,
    choices: [],
    access: "rw",
    identity: false,
    expert: false,
    ...more,
  }) as unknown as Row;

const reading = (key: string, value: Reading["value"], maximum = 180): Reading =>
  ({
    key,
    value,
    configured: value,
    raw: 1,
    unit: "°",
    age_s: 0,
    rom: value,
    minimum: 0,
    maximum,
    stale: false,
  }) as Reading;

describe("staging", () => {
  beforeEach(() => {
    for (const uid of [A, B]) {
      sheetOf(uid).drafts.clear();
      sheetOf(uid).take("1", {
        limit: reading("limit", uid === A ? 90 : 60, uid === A ? 180 : 80),
        gain: reading("gain", uid === A ? 5 : 7),
        torque_mode: reading("torque_mode", uid === A ? "off" : "on"),
        origin: reading("origin", uid === A ? 1 : 2),
      });
    }
  });
  const rows = [
    row("limit"),
    row("gain"),
    row("torque_mode"),
    row("origin", { identity: true }),
    row("absent"),
  ];

  test("a copy leaves out identity, torque mode and what the other does not allow, and counts the last", () => {
    const { drafts, left } = copyOf(sheetOf(A), sheetOf(B), rows);
    expect([...drafts.keys()]).toEqual(["gain"]);
    expect(left).toBe(1);
  });

  test("a value is judged by the range of each servo", () => {
    expect(draftFor(sheetOf(A), row("limit"), 90)).toMatchObject({ verdict: { ok: true, value: 90 } });
    expect(draftFor(sheetOf(B), row("limit"), 90)).toHaveProperty("why");
    expect(draftFor(sheetOf(B), row("absent"), 90)).toEqual({ why: "" });
  });

  test("what RAM holds already is not staged", () => {
    stageValue(sheetOf(A), "limit", { text: "90", verdict: { ok: true, value: 90 } });
    expect(stagedOn([A, B]).size).toBe(0);
  });

  test("one request carries every servo with its revision, and each gets its result", async () => {
    stageValue(sheetOf(A), "gain", { text: "6", verdict: { ok: true, value: 6 } });
    stageValue(sheetOf(B), "gain", { text: "6", verdict: { ok: true, value: 6 } });
    const sent: Record<string, unknown>[] = [];
    const change = { key: "gain", before: 5, requested: 6, after: 6, verdict: "applied" };
    const problem = {
      code: "busy",
      status: 409,
      detail: "It is being saved.",
      summary: "It is being saved.",
      title: "",
      type: "",
    };
    vi.stubGlobal("fetch", async (_: string, init: RequestInit) => {
      sent.push(JSON.parse(String(init.body)));
      return new Response(
        JSON.stringify({
          servos: [
            { uid: A, outcome: "applied", changes: [change], revision: "2", job: null, problem: null },
            { uid: B, outcome: "rejected", changes: [], revision: "1", job: null, problem },
          ],
        }),
      );
    });
    await writeMatrix(stagedOn([A, B]), { dry_run: false, save: false, confirm: [] });
    expect(sent[0]).toMatchObject({
      servos: { [A]: { gain: 6 }, [B]: { gain: 6 } },
      revisions: { [A]: "1", [B]: "1" },
    });
    expect(sheetOf(A).revision).toBe("2");
    expect(sheetOf(A).drafts.map.value.size).toBe(0);
    expect(sheetOf(B).outcomes.value.get("gain")?.kind).toBe("failed");
    expect(sheetOf(B).drafts.map.value.size).toBe(1);
  });

  afterEach(() => vi.unstubAllGlobals());
});
