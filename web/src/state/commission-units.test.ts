/** Tests the verdicts of commissioning: what a job's steps and sheets say of each servo, and of several jobs together. */
import { describe, expect, it } from "vitest";
import type { Job, JobStep } from "../api/types";
import { kindOf, merged, resumableOf, type Sheet, tally, textOf, unitsOf } from "./commission-units";

const A = "a".repeat(32);
const B = "b".repeat(32);

const step = (name: string, uid: string, state: JobStep["state"], text = "Rudder: Saved"): JobStep => ({
  name,
  text,
  uid,
  state,
  evidence: null,
  started_at: null,
  ended_at: null,
});

const sheet = (uid: string, verdict: string) => ({ uid, verdict, values: {} }) as Sheet;

function job(state: Job["state"], steps: JobStep[], units: Sheet[], id = "1"): Job {
  return {
    id,
    kind: "commissioning",
    uid: null,
    state,
    progress: 0,
    step: null,
    result: { units } as unknown as Job["result"],
    error: null,
    steps,
    created_at: 0,
    ended_at: null,
    resumable: state === "failed",
  };
}

const verdicts = (one: Job) => unitsOf(one).map(unit => unit.verdict);

describe("the verdict of a servo", () => {
  it("is of its steps while they run", () => {
    const one = job(
      "running",
      [step("write 1", A, "running"), step("write 2", B, "waiting")],
      [sheet(A, "waiting"), sheet(B, "waiting")],
    );
    expect(verdicts(one)).toEqual(["running", "waiting"]);
  });

  it("is failed as soon as a step failed, before its sheet says so", () => {
    expect(verdicts(job("running", [step("write 1", A, "failed")], [sheet(A, "waiting")]))).toEqual([
      "failed",
    ]);
  });

  it("is done when every step is, and not a moment before", () => {
    const steps = [step("write 1", A, "done"), step("verify 1", A, "waiting")];
    expect(verdicts(job("running", steps, [sheet(A, "waiting")]))).toEqual(["waiting"]);
    expect(verdicts(job("running", [step("write 1", A, "done")], [sheet(A, "waiting")]))).toEqual(["done"]);
  });

  it("is not tried for whoever waited when the job ended", () => {
    expect(verdicts(job("failed", [step("write 1", A, "waiting")], [sheet(A, "not_tried")]))).toEqual([
      "not_tried",
    ]);
    expect(verdicts(job("failed", [step("write 1", A, "skipped")], [sheet(A, "not_tried")]))).toEqual([
      "not_tried",
    ]);
  });

  it("is failed for one that was cut off between two steps", () => {
    const steps = [step("write 1", A, "done"), step("save 1", A, "waiting")];
    expect(verdicts(job("failed", steps, [sheet(A, "waiting")]))).toEqual(["failed"]);
  });

  it("needs no sheets: a job just started has none", () => {
    const one = { ...job("queued", [step("write 1", A, "waiting")], []), result: null };
    expect(verdicts(one)).toEqual(["waiting"]);
  });
});

describe("several jobs together", () => {
  const first = job(
    "failed",
    [step("write 1", A, "done"), step("write 2", B, "failed")],
    [sheet(A, "done"), sheet(B, "failed")],
  );

  it("show a servo as its newest job does", () => {
    const again = job("succeeded", [step("write 1", B, "done")], [sheet(B, "done")], "2");
    const units = merged([first, again]);
    expect(units.map(unit => [unit.uid, unit.verdict, unit.job.id])).toEqual([
      [A, "done", "1"],
      [B, "done", "2"],
    ]);
    expect(tally(units)).toEqual({ done: 2, failed: 0, rest: 0 });
  });

  it("never take a done servo back because another job did not come to it", () => {
    const again = job("failed", [step("write 1", A, "skipped")], [sheet(A, "not_tried")], "2");
    expect(merged([first, again])[0]?.verdict).toBe("done");
  });

  it("can be gone on with where one says so", () => {
    expect(resumableOf([first])?.id).toBe("1");
    expect(resumableOf([job("succeeded", [], [])])).toBeNull();
  });
});

it("says a step without its place and its servo's name", () => {
  expect(kindOf(step("write 12", A, "done"))).toBe("write");
  expect(textOf(step("write 12", A, "done"))).toBe("Saved");
});
