/** Live verification: its state, the step to do now, and the cause of each result. */
import { signal } from "@preact/signals";
import type { AutopilotPlan, AutopilotProgram, Verification, VerifyRow } from "../api/autopilot-types";
import { callApi, problemOf } from "../api/client";
import { monotonic } from "../bench/clock";
import { problemText } from "../bench/facts";
import { number, withUnit } from "../bench/format";
import { readTab, writeTab } from "../bench/tab-store";
import { autopilotWords as words } from "./words";

const STORE = "hornbill.verifying";

/** Null while none is running. */
export const verification = signal<Verification | null>(null);
/** When it was read, monotonic. */
export const readAt = signal(0);
export const verifyProblem = signal<string | null>(null);
/** Neutral has been measured since the start. */
export const neutralDone = signal(false);
/** The last step moved nothing. */
export const nothingMoved = signal<number | null>(null);

function take(next: Verification | null): void {
  const before = verification.peek();
  if (before !== null && before.step !== null && next?.step === null) {
    neutralDone.value = true;
    const row = next.rows.find(one => one.output === before.output);
    nothingMoved.value = row?.result === "not_moved" ? row.output : null;
  }
  readAt.value = monotonic();
  writeTab(STORE, next !== null);
  verification.value = next;
}

/** Read the state after a reload, if this tab has started a verification. */
export async function resumeVerification(): Promise<void> {
  if (readTab(STORE) === true) await readVerification();
}

/** Read the state. */
export async function readVerification(): Promise<void> {
  try {
    take(await callApi("GET", "/autopilot/verification"));
    verifyProblem.value = null;
  } catch (error) {
    const problem = problemOf(error);
    if (problem.code === "no_verification") take(null);
    else verifyProblem.value = problemText(problem);
  }
}

async function does(act: () => Promise<Verification | null>): Promise<boolean> {
  verifyProblem.value = null;
  try {
    take(await act());
    return true;
  } catch (error) {
    verifyProblem.value = problemText(problemOf(error));
    return false;
  }
}

export function beginVerification(plan: AutopilotPlan): Promise<boolean> {
  verification.value = null;
  neutralDone.value = false;
  nothingMoved.value = null;
  return does(() => callApi("PUT", "/autopilot/verification", { body: plan }));
}

export function beginStep({ kind, output }: Pick<VerifyStepNow, "kind" | "output">): Promise<boolean> {
  nothingMoved.value = null;
  return does(() => callApi("POST", "/autopilot/verification/steps", { body: { kind, output } }));
}

export function endVerification(): Promise<boolean> {
  return does(async () => {
    await callApi("DELETE", "/autopilot/verification");
    return null;
  });
}

export interface VerifyStepNow {
  kind: "neutral" | "positive";
  output: number | null;
  n: number;
  of: number;
}

/** Outputs that a control can move: others wait for a change on the autopilot. */
const measurable = (row: VerifyRow) => row.result !== "missing" && row.result !== "wrong_type";
const measured = (row: VerifyRow) => measurable(row) && row.result !== "not_moved";

/** The step to do next: neutral, then each output that has no result. Null if all have one. */
export function nextStep(list: readonly VerifyRow[], neutral: boolean): VerifyStepNow | null {
  const able = list.filter(measurable);
  const done = able.filter(measured).length;
  const of = able.length + 1;
  if (able.length === 0) return null;
  if (!neutral && done === 0) return { kind: "neutral", output: null, n: 1, of };
  const next = able.find(one => !measured(one));
  return next ? { kind: "positive", output: next.output, n: done + 2, of } : null;
}

/** The step in progress, numbered like the steps to do. */
export function presentStep(state: Verification): VerifyStepNow | null {
  if (state.step === null) return null;
  const able = state.rows.filter(measurable);
  const n =
    state.step === "neutral"
      ? 1
      : able.filter(one => measured(one) && one.output !== state.output).length + 2;
  return { kind: state.step, output: state.output, n: Math.min(n, able.length + 1), of: able.length + 1 };
}

export type Tone = "ok" | "failure" | "warning" | "none";

export function toneOf({ result }: Pick<VerifyRow, "result">): Tone {
  switch (result) {
    case "matches":
      return "ok";
    case "not_moved":
      return "none";
    case "throw_too_small":
      return "warning";
    default:
      return "failure";
  }
}

export function countsOf(list: readonly VerifyRow[]): Record<Tone, number> {
  const found: Record<Tone, number> = { ok: 0, failure: 0, warning: 0, none: 0 };
  for (const one of list) found[toneOf(one)] += 1;
  return found;
}

/** No ArrayCommand with an entry for any output has been seen. */
export const silent = (list: readonly VerifyRow[]) =>
  list.every(one => one.last_deg === null && one.result !== "wrong_type");

const STEP_DEG = 0.36;
const MIDDLE: Readonly<Record<AutopilotProgram, number>> = { ardupilot: 1500, px4: 500 };

/** Names of the parameters of an output. */
const NAMES = {
  ardupilot: {
    min: (n: number) => `SERVO${n}_MIN`,
    max: (n: number) => `SERVO${n}_MAX`,
    neutral: (n: number) => `SERVO${n}_TRIM`,
  },
  px4: {
    min: (n: number) => `UAVCAN_SV_MIN${n}`,
    max: (n: number) => `UAVCAN_SV_MAX${n}`,
    neutral: (n: number) => `UAVCAN_SV_MIN${n}, _MAX${n}`,
  },
} as const satisfies Record<AutopilotProgram, unknown>;

/** The autopilot's number for an angle: µs for ArduPilot. */
export function unitsOf(program: AutopilotProgram, degrees: number): number {
  return MIDDLE[program] + Math.round(degrees / STEP_DEG);
}

const isReversed = (row: VerifyRow) =>
  Math.abs(row.positive_deg - row.low_deg) < Math.abs(row.positive_deg - row.high_deg);
const maskOf = (list: readonly VerifyRow[]) => list.reduce((sum, one) => sum + 2 ** (one.output - 1), 0);

/** Cause of a result, with the parameter to change. */
export function causeOf(program: AutopilotProgram, row: VerifyRow, list: readonly VerifyRow[]): string {
  const { output } = row;
  switch (row.result) {
    case "matches":
      return words.within(
        withUnit(number(Math.abs((row.held_deg ?? row.positive_deg) - row.positive_deg), 1), "°"),
      );
    case "reversed":
      return program === "ardupilot"
        ? words.set(`SERVO${output}_REVERSED`, isReversed(row) ? 1 : 0)
        : words.set("UAVCAN_SV_REV", maskOf(list.filter(isReversed)));
    case "swapped":
      return words.swapped(output, row.swapped_with ?? 0);
    case "missing":
      return program === "ardupilot"
        ? words.set("CAN_D1_UC_SRV_BM", maskOf(list))
        : words.assign(`UAVCAN_SV_FUNC${output}`);
    case "wrong_type":
      return words.wrongType[program];
    case "not_moved":
      return row.held_deg === null ? words.notMoved : words.neutralWithin;
    default:
      return throwCause(program, row);
  }
}

function throwCause(program: AutopilotProgram, row: VerifyRow): string {
  const held = row.held_deg ?? row.positive_deg;
  const away = (degrees: number) => Math.abs(held - degrees);
  const atNeutral =
    away(row.neutral_deg) < away(row.positive_deg) && away(row.neutral_deg) < 0.3 * away(row.positive_deg);
  const which = atNeutral ? "neutral" : isReversed(row) ? "min" : "max";
  const exported = atNeutral ? row.neutral_deg : row.positive_deg;
  return words.acts(NAMES[program][which](row.output), unitsOf(program, held), unitsOf(program, exported));
}

/** Half the range of the scales: all ends and all that was seen, in steps of 15°. */
export function halfRange(list: readonly VerifyRow[]): number {
  const most = Math.max(
    15,
    ...list
      .flatMap(one => [one.low_deg, one.high_deg, one.seen_low_deg ?? 0, one.seen_high_deg ?? 0])
      .map(Math.abs),
  );
  return Math.min(180, Math.ceil(most / 15) * 15);
}
