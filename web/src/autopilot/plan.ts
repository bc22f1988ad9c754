/** The plan being edited: one draft per output and program, kept for the tab. */
import { computed, effect, signal } from "@preact/signals";
import type { AdviceItem, AutopilotPlan, AutopilotProgram, PlanOutput } from "../api/autopilot-types";
import { callApi, Problem, problemOf } from "../api/client";
import { problemText } from "../bench/facts";
import { all, nameOf } from "../bench/fleet";
import { number } from "../bench/format";
import { parseNumber, wholeNumber } from "../bench/number";
import { readTab, writeTab } from "../bench/tab-store";
import { autopilotWords as words } from "./words";

export const PROGRAMS = ["ardupilot", "px4"] as const satisfies readonly AutopilotProgram[];

/** Servo IDs that a program commands. */
export const IDS: Readonly<Record<AutopilotProgram, readonly [number, number]>> = {
  ardupilot: [1, 32],
  px4: [0, 7],
};

const USUAL_HZ = 50;
const FASTEST_HZ = 200;

/** An output as typed. */
export interface OutputDraft {
  output: number;
  servo_id: number;
  label: string;
  low: string;
  neutral: string;
  high: string;
  reversed: boolean;
  function: string;
}

interface Drafts {
  program: AutopilotProgram;
  rate: string;
  /** Null until proposed. */
  outputs: Record<AutopilotProgram, readonly OutputDraft[] | null>;
  /** File that was imported or exported. Empty if none. */
  source: string;
}

const STORE = "hornbill.autopilot";
const NEW: Drafts = {
  program: "ardupilot",
  rate: String(USUAL_HZ),
  outputs: { ardupilot: null, px4: null },
  source: "",
};

export const drafts = signal<Drafts>({ ...NEW, ...(readTab(STORE) as Partial<Drafts> | null) });
effect(() => writeTab(STORE, drafts.value));

/** Points to check, of the last export or import. */
export const advice = signal<readonly AdviceItem[]>([]);
export const planProblem = signal<string | null>(null);
/** What was done last. */
export const planNote = signal<string | null>(null);

export const rows = computed(() => drafts.value.outputs[drafts.value.program]);

/** Change the drafts. What was said of the former plan no longer applies. */
export function edit(change: Partial<Drafts>): void {
  drafts.value = { ...drafts.peek(), source: "", ...change };
  planProblem.value = null;
  planNote.value = null;
  advice.value = [];
}

export function editOutput(output: number, change: Partial<OutputDraft>): void {
  const { program, outputs } = drafts.peek();
  const next = (outputs[program] ?? []).map(one => (one.output === output ? { ...one, ...change } : one));
  edit({ outputs: { ...outputs, [program]: next } });
}

export function removeOutput(output: number): void {
  const { program, outputs } = drafts.peek();
  const next = (outputs[program] ?? []).filter(one => one.output !== output);
  edit({ outputs: { ...outputs, [program]: next } });
}

export function draftOf(one: AutopilotPlan["outputs"][number]): OutputDraft {
  const { label = "", neutral_deg = 0, reversed = false, function: chosen = null } = one;
  const typed = (value: number) => number(value, Number.isInteger(value * 10) ? 1 : 2);
  return {
    output: one.output,
    servo_id: one.servo_id,
    label: label || nameOfId(one.servo_id),
    low: typed(one.low_deg),
    neutral: typed(neutral_deg),
    high: typed(one.high_deg),
    reversed,
    function: chosen === null ? "" : String(chosen),
  };
}

/** Name of the online servo with this ID. Empty if there is none. */
function nameOfId(id: number): string {
  const found = all.peek().find(one => one.online && one.servo_id === id);
  return found ? nameOf(found).slice(0, 40) : "";
}

/** The output, or null if a field is no number. */
export function outputOf(one: OutputDraft): PlanOutput | null {
  const [low, neutral, high] = [one.low, one.neutral, one.high].map(typed => parseNumber(typed, "°"));
  const chosen = one.function.trim() === "" ? null : wholeNumber(one.function);
  if (low == null || neutral == null || high == null) return null;
  if (chosen === null && one.function.trim() !== "") return null;
  return {
    output: one.output,
    servo_id: one.servo_id,
    label: one.label,
    low_deg: low,
    neutral_deg: neutral,
    high_deg: high,
    reversed: one.reversed,
    function: chosen,
  };
}

export function rateOf(typed: string): number | null {
  const rate = wholeNumber(typed);
  return rate !== null && rate >= 1 && rate <= FASTEST_HZ ? rate : null;
}

/** Outputs with a field that is no number. */
export const incomplete = computed(() =>
  (rows.value ?? []).filter(one => outputOf(one) === null).map(one => one.output),
);

/** The plan for the server. Null if it is empty or incomplete. */
export function planOf({ program, rate, outputs }: Drafts): AutopilotPlan | null {
  const found = (outputs[program] ?? []).map(outputOf);
  const complete = found.filter(one => one !== null);
  const hz = rateOf(rate);
  if (found.length === 0 || complete.length < found.length || hz === null) return null;
  return { program, rate_hz: hz, outputs: complete };
}

/** Outputs for the connected servos, from the server. */
export async function proposeOutputs(program = drafts.peek().program): Promise<void> {
  try {
    const found = await callApi("GET", "/autopilot/plan", { query: { program } });
    edit({ outputs: { ...drafts.peek().outputs, [program]: found.map(draftOf) } });
  } catch (error) {
    planProblem.value = problemText(problemOf(error));
  }
}

/** Write the file of the plan, and hand it to `save`. */
export async function exportPlan(save: (name: string, content: string) => void): Promise<void> {
  const plan = planOf(drafts.peek());
  if (plan === null) return;
  planProblem.value = null;
  try {
    const file = await callApi("POST", "/autopilot/export", { body: plan });
    save(file.name, file.text);
    drafts.value = { ...drafts.peek(), source: file.name };
    advice.value = file.advice;
    planNote.value = words.exported(file.name);
  } catch (error) {
    planNote.value = null;
    advice.value = [];
    planProblem.value = problemText(problemOf(error));
  }
}

const LONGEST = 2_000_000;

/** Read a parameter file: `.params` is PX4's, other names are those of the chosen program. */
export async function importPlan(file: Pick<File, "name" | "text" | "size">): Promise<void> {
  const program = file.name.endsWith(".params") ? "px4" : drafts.peek().program;
  planProblem.value = null;
  planNote.value = null;
  try {
    const content = file.size > LONGEST ? null : await file.text();
    if (content === null) throw new Problem("parameter_file_too_long", 0, `${file.size} > ${LONGEST}`);
    const found = await callApi("POST", "/autopilot/import", { body: { program, text: content } });
    edit({
      program,
      rate: String(found.plan.rate_hz),
      outputs: { ...drafts.peek().outputs, [program]: found.plan.outputs.map(draftOf) },
      source: file.name,
    });
    advice.value = found.advice;
    planNote.value = words.imported(file.name, found.plan.outputs.length);
  } catch (error) {
    planProblem.value = problemText(problemOf(error));
  }
}

/** Points to check with the outputs they concern, one per code. */
export function adviceByCode(list: readonly AdviceItem[]): { code: AdviceItem["code"]; outputs: number[] }[] {
  const found = new Map<AdviceItem["code"], number[]>();
  for (const one of list) {
    const outputs = found.get(one.code) ?? [];
    found.set(one.code, one.output === null ? outputs : [...outputs, one.output]);
  }
  return [...found].map(([code, outputs]) => ({ code, outputs }));
}
