/** A change to servos: options, check by the server, confirmation, execution, and the result of each servo. */

import { computed, type Signal, signal } from "@preact/signals";
import { type Problem, problemOf } from "../api/client";
import type { Forecast, SafetyWord } from "../api/config-types";
import type { Job } from "../api/types";
import { problemText } from "../bench/facts";
import { nameOf, peekServo } from "../bench/fleet";
import { jobs } from "../bench/jobs";
import { observing } from "../bench/role";
import { text } from "../text";
import { HornFree } from "./horn-free";
import { isOpen, wordsOf } from "./safety-words";

/** Selects the words of the dialog. */
export type ChangeKind =
  | "apply"
  | "save"
  | "undo"
  | "snapshot"
  | "drift"
  | "batch"
  | "batch-save"
  | "profile"
  | "restart"
  | "factory-reset"
  | "output"
  | "plan"
  | "plan-resume";

export interface PlanOptions {
  save: boolean;
  confirm: readonly SafetyWord[];
}

/** A row with its current and new value. */
export interface RowChange {
  key: string;
  now: unknown;
  next: unknown;
  /** Note on the row. */
  doubt?: boolean;
}

/** One servo in a plan. */
export interface Part {
  uid: string;
  changes: readonly RowChange[];
  /** Rows whose ROM value changes. */
  rom?: readonly RowChange[];
  /** Rows without a change. */
  unchanged?: number;
  /** Rows that a save writes to ROM while their ROM value is unknown. */
  unknown?: number;
  /** Rows that are skipped, and why. */
  leftOut?: readonly { key: string; why: string }[];
  /** Movement of the horn at the restart: null if unknown, absent without a restart. */
  restart?: Forecast | null;
  /** Why the servo is excluded. */
  problem?: Problem | null;
}

/** Result of one servo. */
export interface Turn {
  /** Empty if one job handles all servos. */
  uid: string;
  state: "waiting" | "running" | "done" | "failed" | "left_out";
  job: string | null;
  /** Number of rows written. */
  count: number;
  saved: boolean;
  /** Kind of failure; `why` has details. */
  fault: "rolled_back" | "not_written" | "not_saved" | null;
  why: string | null;
}

export type Report = (uid: string, to: Partial<Turn>) => void;

/** A change as data: questions before it, and its execution. The dialog does the rest. */
export interface ChangeRequest {
  kind: ChangeKind;
  /** "optional": a check box, never checked initially. */
  save: "optional" | "always" | "never";
  /**
   * A dry run: throws what the change itself would be refused with. Without one, the dialog opens only if the server
   * requires a confirmation.
   */
  plan?: (opts: PlanOptions) => Promise<readonly Part[]>;
  run: (opts: PlanOptions, able: readonly Part[], report: Report) => Promise<void>;
  /** One job handles all servos of the plan. */
  together?: boolean;
  /** Number of values, if there is no plan. */
  count?: number;
  /** A further condition. */
  ready?: () => boolean;
  /** Pointless if no row changes. */
  needsChanges?: boolean;
  /** The dialog closes automatically on success. */
  quick?: boolean;
  /** An alternative action. */
  other?: () => Promise<void>;
  /** Content of the dialog besides the plan. */
  facts?: unknown;
  /** Called with the result when the dialog closes; without one if nothing was done. */
  onClose?: (turns: readonly Turn[]) => void;
}

export class ChangeFlow {
  readonly request: ChangeRequest;
  readonly phase = signal<"planning" | "ready" | "running" | "over">("ready");
  /** The last refusal. */
  readonly problem: Signal<Problem | null> = signal(null);
  readonly save: Signal<boolean>;
  readonly required: Signal<readonly SafetyWord[]> = signal([]);
  readonly agreed: Signal<readonly SafetyWord[]> = signal([]);
  readonly turns: Signal<readonly Turn[]> = signal([]);
  readonly #planned: Signal<{ opts: PlanOptions; parts: readonly Part[] } | null> = signal(null);

  /** Null before the first plan. */
  readonly parts = computed(() => this.#planned.value?.parts ?? null);
  readonly able = computed(() => (this.parts.value ?? []).filter(one => !one.problem));
  /** A required confirmation is missing. */
  readonly open = computed(() => isOpen(this.required.value, this.agreed.value));
  /** The plan matches the options. */
  readonly current = computed(
    () => this.request.plan === undefined || same(this.#planned.value?.opts, this.#opts()),
  );
  readonly free = new HornFree(() => this.able.value.filter(one => one.restart !== undefined));
  readonly rows = computed(() =>
    this.able.value.reduce((sum, one) => sum + one.changes.length + (one.rom?.length ?? 0), 0),
  );
  readonly mayGo = computed(
    () =>
      this.phase.value === "ready" &&
      this.current.value &&
      !this.open.value &&
      this.free.agreed &&
      (this.request.plan === undefined || this.able.value.length > 0) &&
      (!this.request.needsChanges || this.save.value || this.rows.value > 0) &&
      (this.request.ready?.() ?? true),
  );

  constructor(request: ChangeRequest) {
    this.request = request;
    this.save = signal(request.save === "always");
  }

  /** Request a dry run. */
  async look(): Promise<void> {
    const opts = this.#opts();
    this.phase.value = "planning";
    this.problem.value = null;
    try {
      const parts = (await this.request.plan?.(opts)) ?? [];
      this.#planned.value = { opts, parts };
      this.#callApi(parts.flatMap(one => (one.problem ? wordsOf(one.problem) : [])));
    } catch (error) {
      this.#refused(problemOf(error));
    }
    this.phase.value = "ready";
  }

  /** Change an option and check again; undone if refused outright. */
  async choose(change: () => void, back: () => void): Promise<void> {
    change();
    this.required.value = [];
    this.agreed.value = [];
    await this.look();
    if (this.problem.peek() !== null && !this.open.peek()) back();
  }

  /** The plan is outdated: the options have changed. */
  forget(): void {
    this.#planned.value = null;
    this.turns.value = [];
  }

  async go(): Promise<void> {
    if (!this.mayGo.peek()) return;
    const able = this.able.peek();
    const uids = this.request.together || able.length === 0 ? [""] : able.map(one => one.uid);
    this.phase.value = "running";
    this.problem.value = null;
    this.turns.value = uids.map(uid => ({ ...WAITING, uid }));
    begun.value = [...begun.peek(), this];
    try {
      await this.request.run(this.#opts(), able, (uid, to) => this.#report(uid, to));
      this.phase.value = "over";
    } catch (error) {
      this.turns.value = [];
      this.#refused(problemOf(error));
      this.phase.value = "ready";
    }
    // A failure with a hidden dialog stays visible.
    if (this.well || this.request.quick || shownChange.peek() === this) done(this);
  }

  /** Run the alternative action. */
  async instead(): Promise<void> {
    this.phase.value = "running";
    this.problem.value = null;
    try {
      await this.request.other?.();
    } catch (error) {
      this.problem.value = problemOf(error);
    }
    this.phase.value = "ready";
  }

  /** Servos of the change. */
  get uids(): readonly string[] {
    const { facts } = this.request;
    return typeof facts === "string" ? [facts] : this.able.value.map(one => one.uid);
  }

  /** Jobs started by it. */
  get jobs(): readonly Job[] {
    return this.turns.value.flatMap(one => (one.job === null ? [] : (jobs.value.get(one.job) ?? [])));
  }

  /** Everything has succeeded. */
  get well(): boolean {
    return this.phase.value === "over" && this.turns.value.every(one => one.state === "done");
  }

  #opts(): PlanOptions {
    return { save: this.save.value, confirm: this.agreed.value };
  }

  #refused(problem: Problem): void {
    this.problem.value = problem;
    this.#callApi(wordsOf(problem));
  }

  #callApi(words: readonly SafetyWord[]): void {
    this.required.value = [...new Set([...this.required.peek(), ...words])];
  }

  #report(uid: string, to: Partial<Turn>): void {
    this.turns.value = this.turns.peek().map(one => (one.uid === uid ? { ...one, ...to } : one));
  }
}

const WAITING: Omit<Turn, "uid"> = {
  state: "waiting",
  job: null,
  count: 0,
  saved: false,
  fault: null,
  why: null,
};

function same(one: PlanOptions | undefined, other: PlanOptions): boolean {
  return (
    one !== undefined &&
    one.save === other.save &&
    one.confirm.length === other.confirm.length &&
    one.confirm.every(word => other.confirm.includes(word))
  );
}

/** The change whose dialog is open. */
export const shownChange: Signal<ChangeFlow | null> = signal(null);

/** Running changes, and those that failed with a hidden dialog. */
export const begun: Signal<readonly ChangeFlow[]> = signal([]);

function done(flow: ChangeFlow): void {
  begun.value = begun.peek().filter(one => one !== flow);
}

/** True if a change is running on one of these servos. Edits are shown by their rows. */
export function underWay(uids: readonly string[]): boolean {
  return begun.value.some(
    flow =>
      flow.request.kind !== "apply" &&
      flow.phase.value === "running" &&
      flow.uids.some(uid => uids.includes(uid)),
  );
}

/** Check a change and open its dialog. Returns the reason if refused, or null. */
export async function beginChange(
  request: ChangeRequest,
  flow = new ChangeFlow(request),
): Promise<string | null> {
  if (observing.peek()) return text.motion.whileObserving;
  await flow.look();
  const parts = flow.parts.peek();
  const confirms = flow.required.peek().length > 0 || request.other !== undefined;
  const [first] = parts ?? [];
  const refused = flow.problem.peek() ?? (parts?.every(one => one.problem) ? first?.problem : null);
  if (refused && !confirms) {
    const name = (parts?.length ?? 0) > 1 && first ? `${nameOf(peekServo(first.uid))}: ` : "";
    return name + problemText(refused);
  }
  shownChange.value = flow;
  return null;
}

/** Open the dialog of a change that is planned there. */
export function openChange(request: ChangeRequest): ChangeFlow {
  const flow = new ChangeFlow(request);
  shownChange.value = flow;
  return flow;
}

/** Run a change without questions; its dialog opens only if the server requires a confirmation. */
export async function doChange(request: ChangeRequest): Promise<boolean> {
  const flow = new ChangeFlow(request);
  await flow.go();
  if (flow.open.peek()) shownChange.value = flow;
  return flow.well;
}

export function closeChange(): void {
  const flow = shownChange.peek();
  shownChange.value = null;
  if (flow && flow.phase.peek() !== "running") done(flow);
  flow?.request.onClose?.(flow.turns.peek());
}
