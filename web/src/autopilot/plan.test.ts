/** The plan being edited: typed values, proposals, files. */
import { beforeEach, describe, expect, test, vi } from "vitest";
import type { PlanOutput } from "../api/autopilot-types";
import { callApi, Problem } from "../api/client";
import {
  advice,
  adviceByCode,
  draftOf,
  drafts,
  edit,
  editOutput,
  exportPlan,
  importPlan,
  incomplete,
  outputOf,
  planNote,
  planOf,
  planProblem,
  proposeOutputs,
  rateOf,
  removeOutput,
  rows,
} from "./plan";

vi.mock("../api/client", async original => ({ ...(await original<object>()), callApi: vi.fn() }));

const api = vi.mocked(callApi) as unknown as ReturnType<typeof vi.fn>;

const output = (n: number, change: Partial<PlanOutput> = {}): PlanOutput => ({
  output: n,
  servo_id: n,
  label: `Servo ${n}`,
  low_deg: -36,
  neutral_deg: 0,
  high_deg: 25.2,
  reversed: false,
  function: null,
  ...change,
});

beforeEach(() => {
  api.mockReset();
  edit({
    program: "ardupilot",
    rate: "50",
    outputs: { ardupilot: [output(1), output(3)].map(draftOf), px4: null },
  });
});

describe("A typed output", () => {
  test("returns what the server proposed", () => {
    const one = output(2, { low_deg: -20.16, reversed: true, function: 4 });
    expect(outputOf(draftOf(one))).toEqual(one);
  });

  test.each([{ low: "" }, { high: "abc" }, { neutral: "1..2" }, { function: "x" }])(
    "is incomplete with %o",
    typed => {
      editOutput(3, typed);
      expect(incomplete.value).toEqual([3]);
      expect(planOf(drafts.value)).toBeNull();
    },
  );

  test("keeps the other program's outputs", () => {
    edit({ program: "px4" });
    expect(rows.value).toBeNull();
    edit({ program: "ardupilot" });
    removeOutput(1);
    expect(rows.value?.map(one => one.output)).toEqual([3]);
  });
});

test.each([
  ["200", 200],
  ["0", null],
  ["201", null],
  ["fast", null],
])("a rate of %s Hz", (typed, rate) => {
  expect(rateOf(typed)).toBe(rate);
});

test("a plan without outputs is not sent", async () => {
  edit({ outputs: { ardupilot: [], px4: null } });
  await exportPlan(vi.fn());
  expect(api).not.toHaveBeenCalled();
});

test("an export is saved with its advice, and forgotten with the next edit", async () => {
  api.mockResolvedValue({
    name: "hornbill.param",
    text: "SERVO1_MIN,1400\n",
    advice: [{ code: "servo_id_zero", text: "", output: 1 }],
  });
  const save = vi.fn();
  await exportPlan(save);
  expect(save).toHaveBeenCalledWith("hornbill.param", "SERVO1_MIN,1400\n");
  expect(planNote.value).toContain("hornbill.param");
  expect(advice.value).toHaveLength(1);
  editOutput(1, { high: "20" });
  expect([planNote.value, advice.value, drafts.value.source]).toEqual([null, [], ""]);
});

test("a refused export says why and saves nothing", async () => {
  api.mockRejectedValue(new Problem("out_of_range", 422, "The end 90° is beyond the limit of 60°."));
  const save = vi.fn();
  await exportPlan(save);
  expect(save).not.toHaveBeenCalled();
  expect(planProblem.value).toContain("60°");
});

test("a .params file is read as PX4's, with names of its own", async () => {
  api.mockResolvedValue({
    plan: { program: "px4", rate_hz: 50, outputs: [output(1, { servo_id: 0, label: "" })] },
    advice: [],
  });
  await importPlan({
    name: "plane.params",
    size: 10,
    text: async () => "1\t1\tUAVCAN_SV_FUNC1\t201\t6",
  } as File);
  expect(api.mock.calls[0]?.[2]).toEqual({
    body: { program: "px4", text: "1\t1\tUAVCAN_SV_FUNC1\t201\t6" },
  });
  expect([drafts.value.program, drafts.value.source]).toEqual(["px4", "plane.params"]);
  expect(rows.value?.map(one => one.servo_id)).toEqual([0]);
});

test("a file that is too long is not read", async () => {
  const content = vi.fn();
  await importPlan({ name: "a.param", size: 3_000_000, text: content } as unknown as File);
  expect(content).not.toHaveBeenCalled();
  expect(planProblem.value).not.toBeNull();
});

test("a failed proposal keeps the outputs", async () => {
  api.mockRejectedValue(new Problem("no_link", 0, ""));
  await proposeOutputs();
  expect(rows.value).toHaveLength(2);
  expect(planProblem.value).not.toBeNull();
});

test("advice is grouped by code, with the outputs it concerns", () => {
  expect(
    adviceByCode([
      { code: "step_above_deadband", text: "", output: 1 },
      { code: "position_in_log", text: "", output: null },
      { code: "step_above_deadband", text: "", output: 4 },
    ]),
  ).toEqual([
    { code: "step_above_deadband", outputs: [1, 4] },
    { code: "position_in_log", outputs: [] },
  ]);
});
