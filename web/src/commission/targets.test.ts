/** Tests the verdicts of commissioning: what a job's steps and records say of each servo, and of several jobs together. */
import { describe, expect, it } from "vitest";
import type { Job, JobStep, StepCode } from "../api/types";
import { merged, resumableOf, type TargetRecord, tally, targetsOf, valuesPlaceOf } from "./targets";

const A = "a".repeat(32);
const B = "b".repeat(32);

const step = (
  name: `${StepCode} ${number}`,
  uid: string,
  state: JobStep["state"],
  text = "Rudder: Saved",
): JobStep => ({
  name,
  code: name.split(" ")[0] as StepCode,
  params: { servo: "Rudder" },
  evidence_params: {},
  text,
  uid,
  state,
  evidence: null,
  evidence_code: null,
  ahead: null,
  started_at: null,
  ended_at: null,
});

const record = (uid: string, verdict: string) => ({ uid, verdict, values: {} }) as TargetRecord;

function job(state: Job["state"], steps: JobStep[], targets: TargetRecord[], id = "1"): Job {
  return {
    id,
    kind: "commissioning",
    uid: null,
    state,
    progress: 0,
    step: null,
    result: { servos: targets } as unknown as Job["result"],
    error: null,
    steps,
    created_at: 0,
    ended_at: null,
    resumable: state === "failed",
  };
}

const verdicts = (one: Job) => targetsOf(one).map(target => target.verdict);

describe("the verdict of a servo", () => {
  it("is of its steps while they run", () => {
    const one = job(
      "running",
      [step("write 1", A, "running"), step("write 2", B, "waiting")],
      [record(A, "waiting"), record(B, "waiting")],
    );
    expect(verdicts(one)).toEqual(["running", "waiting"]);
  });

  it("is failed as soon as a step failed, before its record says so", () => {
    expect(verdicts(job("running", [step("write 1", A, "failed")], [record(A, "waiting")]))).toEqual([
      "failed",
    ]);
  });

  it("is done when every step is, and not a moment before", () => {
    const steps = [step("write 1", A, "done"), step("verify 1", A, "waiting")];
    expect(verdicts(job("running", steps, [record(A, "waiting")]))).toEqual(["waiting"]);
    expect(verdicts(job("running", [step("write 1", A, "done")], [record(A, "waiting")]))).toEqual(["done"]);
  });

  it("is not tried for servos that waited when the job ended", () => {
    expect(verdicts(job("failed", [step("write 1", A, "waiting")], [record(A, "not_tried")]))).toEqual([
      "not_tried",
    ]);
    expect(verdicts(job("failed", [step("write 1", A, "skipped")], [record(A, "not_tried")]))).toEqual([
      "not_tried",
    ]);
  });

  it("is failed for one that was cut off between two steps", () => {
    const steps = [step("write 1", A, "done"), step("save 1", A, "waiting")];
    expect(verdicts(job("failed", steps, [record(A, "waiting")]))).toEqual(["failed"]);
  });

  it("needs no records: a job just started has none", () => {
    const one = { ...job("queued", [step("write 1", A, "waiting")], []), result: null };
    expect(verdicts(one)).toEqual(["waiting"]);
  });
});

describe("several jobs together", () => {
  const first = job(
    "failed",
    [step("write 1", A, "done"), step("write 2", B, "failed")],
    [record(A, "done"), record(B, "failed")],
  );

  it("show a servo as its newest job does", () => {
    const again = job("succeeded", [step("write 1", B, "done")], [record(B, "done")], "2");
    const targets = merged([first, again]);
    expect(targets.map(target => [target.uid, target.verdict, target.job.id])).toEqual([
      [A, "done", "1"],
      [B, "done", "2"],
    ]);
    expect(tally(targets, () => "rom")).toEqual({ done: 2, ram: 0, lost: 0, failed: 0, rest: 0 });
  });

  it("never take a done servo back because another job did not come to it", () => {
    const again = job("failed", [step("write 1", A, "skipped")], [record(A, "not_tried")], "2");
    expect(merged([first, again])[0]?.verdict).toBe("done");
  });

  it("can be gone on with where one says so", () => {
    expect(resumableOf([first])?.id).toBe("1");
    expect(resumableOf([job("succeeded", [], [])])).toBeNull();
  });
});

describe("where the values of a servo that is done are", () => {
  const values = { torque_mode: "off", servo_id: 9, angle_limit_cw: 40 };
  const target = (verified_in: string) => {
    const [one] = targetsOf(
      job("succeeded", [step("write 1", A, "done")], [{ ...record(A, "done"), values, verified_in }]),
    );
    if (!one) throw new Error("no target");
    return one;
  };
  const holds = (ram: Record<string, number>, rom: Record<string, number>) => (key: string) => ({
    value: ram[key] ?? null,
    rom: rom[key] ?? null,
  });
  const old = { servo_id: 0, angle_limit_cw: 179.9 };
  const set = { servo_id: 9, angle_limit_cw: 40 };

  it("is ROM where the job read them there", () => {
    expect(valuesPlaceOf(target("rom"), undefined, () => undefined)).toBe("rom");
  });

  it("is RAM without a save, also while the servo is not known to hold anything", () => {
    expect(valuesPlaceOf(target("ram"), { lost: [] }, holds(set, old))).toBe("ram");
    expect(valuesPlaceOf(target("ram"), undefined, () => undefined)).toBe("ram");
  });

  it("is ROM once all of them were saved, whatever became of torque", () => {
    expect(valuesPlaceOf(target("ram"), { lost: [] }, holds(set, { ...set, angle_limit_cw: 179.9 }))).toBe(
      "ram",
    );
    expect(valuesPlaceOf(target("ram"), { lost: [] }, holds(set, set))).toBe("rom");
  });

  it("is nowhere after a restart without a save", () => {
    expect(valuesPlaceOf(target("ram"), { lost: [] }, holds(old, old))).toBe("lost");
    const lost = [{ key: "servo_id", value: 9, at: 0 }];
    expect(valuesPlaceOf(target("ram"), { lost }, () => undefined)).toBe("lost");
  });

  it("counts apart in the tally", () => {
    const [one] = [target("ram")];
    expect(tally([one], () => "ram")).toMatchObject({ done: 0, ram: 1 });
    expect(tally([one], () => "lost")).toMatchObject({ done: 0, lost: 1 });
  });
});
