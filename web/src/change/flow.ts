/** A change to servos: what is asked of it, checked by the server, agreed to here, done, and what came of each servo. */

import { computed, type Signal, signal } from "@preact/signals";
import { type Problem, problemOf } from "../api/client";
import type { Forecast, SafetyWord } from "../api/config-types";
import type { Job } from "../api/types";
import { problemText } from "../bench/facts";
import { nameOf, peekServo } from "../bench/fleet";
import { jobs } from "../bench/jobs";
import { HornFree } from "./horn-free";
import { isOpen, wordsOf } from "./safety-words";

/** Names the dialog's words. */
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
  | "output";

export interface Wish {
  save: boolean;
  confirm: readonly SafetyWord[];
}

/** A row: what it holds, and what it is to. */
export interface RowChange {
  key: string;
  now: unknown;
  next: unknown;
  /** What has to be said of it. */
  doubt?: boolean;
}

/** One servo in a plan. */
export interface Part {
  uid: string;
  changes: readonly RowChange[];
  /** Rows that ROM will hold differently. */
  rom?: readonly RowChange[];
  /** Rows that hold it already. */
  unchanged?: number;
  /** Rows of which a save puts into ROM what is not known of it. */
  unknown?: number;
  /** Rows that are not changed, and why. */
  leftOut?: readonly { key: string; why: string }[];
  /** What the horn does when it restarts: null where that is not known, absent where it does not restart. */
  restart?: Forecast | null;
  /** Why nothing is done to it. */
  problem?: Problem | null;
}

/** What came of one servo. */
export interface Turn {
  /** Empty where one job does it to all. */
  uid: string;
  state: "waiting" | "running" | "done" | "failed" | "left_out";
  job: string | null;
  /** Rows that were written. */
  count: number;
  saved: boolean;
  /** How it failed; `why` says more. */
  fault: "rolled_back" | "not_written" | "not_saved" | null;
  why: string | null;
}

export type Tell = (uid: string, to: Partial<Turn>) => void;

/** A change as data: what to ask beforehand, and what does it. The dialog does the rest. */
export interface ChangeRequest {
  kind: ChangeKind;
  /** "ask": a tick, never ticked beforehand. */
  save: "ask" | "always" | "never";
  /** A dry run: throws what the change itself would be refused with. Without one it is asked about only where the server wants that. */
  plan?: (wish: Wish) => Promise<readonly Part[]>;
  run: (wish: Wish, able: readonly Part[], tell: Tell) => Promise<void>;
  /** One job does it to all servos of the plan. */
  together?: boolean;
  /** How many values it is about, where no plan says it. */
  count?: number;
  /** A further condition. */
  ready?: () => boolean;
  /** It is pointless where no row changes. */
  needsChanges?: boolean;
  /** The dialog closes by itself when all went well. */
  quick?: boolean;
  /** Something else that can be done instead. */
  other?: () => Promise<void>;
  /** What the dialog of its kind shows beside the plan. */
  facts?: unknown;
  /** Told when the dialog is closed, with what came of it; nothing where nothing was done. */
  onClose?: (turns: readonly Turn[]) => void;
}

export class ChangeFlow {
  readonly request: ChangeRequest;
  readonly phase = signal<"planning" | "ready" | "running" | "over">("ready");
  /** What was refused last. */
  readonly problem: Signal<Problem | null> = signal(null);
  readonly save: Signal<boolean>;
  readonly asked: Signal<readonly SafetyWord[]> = signal([]);
  readonly agreed: Signal<readonly SafetyWord[]> = signal([]);
  readonly turns: Signal<readonly Turn[]> = signal([]);
  readonly #planned: Signal<{ wish: Wish; parts: readonly Part[] } | null> = signal(null);

  /** Null before the first plan. */
  readonly parts = computed(() => this.#planned.value?.parts ?? null);
  readonly able = computed(() => (this.parts.value ?? []).filter(one => !one.problem));
  /** Something that the server wants to hear is not said. */
  readonly open = computed(() => isOpen(this.asked.value, this.agreed.value));
  /** What is planned is what would be done. */
  readonly current = computed(
    () => this.request.plan === undefined || same(this.#planned.value?.wish, this.#wish()),
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

  /** Asks the server what would become of it. */
  async look(): Promise<void> {
    const wish = this.#wish();
    this.phase.value = "planning";
    this.problem.value = null;
    try {
      const parts = (await this.request.plan?.(wish)) ?? [];
      this.#planned.value = { wish, parts };
      this.#ask(parts.flatMap(one => (one.problem ? wordsOf(one.problem) : [])));
    } catch (error) {
      this.#refused(problemOf(error));
    }
    this.phase.value = "ready";
  }

  /** Changes what is wished, and looks again; what is refused outright is taken back. */
  async choose(change: () => void, back: () => void): Promise<void> {
    change();
    this.asked.value = [];
    this.agreed.value = [];
    await this.look();
    if (this.problem.peek() !== null && !this.open.peek()) back();
  }

  /** What was planned is another change than what is wished now. */
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
      await this.request.run(this.#wish(), able, (uid, to) => this.#tell(uid, to));
      this.phase.value = "over";
    } catch (error) {
      this.turns.value = [];
      this.#refused(problemOf(error));
      this.phase.value = "ready";
    }
    // What went wrong with its dialog hidden is still to be seen.
    if (this.well || this.request.quick || shownChange.peek() === this) done(this);
  }

  /** Does what can be done instead. */
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

  /** The servos it changes. */
  get uids(): readonly string[] {
    const { facts } = this.request;
    return typeof facts === "string" ? [facts] : this.able.value.map(one => one.uid);
  }

  /** The jobs it has begun. */
  get jobs(): readonly Job[] {
    return this.turns.value.flatMap(one => (one.job === null ? [] : (jobs.value.get(one.job) ?? [])));
  }

  /** Everything that was asked for is done. */
  get well(): boolean {
    return this.phase.value === "over" && this.turns.value.every(one => one.state === "done");
  }

  #wish(): Wish {
    return { save: this.save.value, confirm: this.agreed.value };
  }

  #refused(problem: Problem): void {
    this.problem.value = problem;
    this.#ask(wordsOf(problem));
  }

  #ask(words: readonly SafetyWord[]): void {
    this.asked.value = [...new Set([...this.asked.peek(), ...words])];
  }

  #tell(uid: string, to: Partial<Turn>): void {
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

function same(one: Wish | undefined, other: Wish): boolean {
  return (
    one !== undefined &&
    one.save === other.save &&
    one.confirm.length === other.confirm.length &&
    one.confirm.every(word => other.confirm.includes(word))
  );
}

/** The change whose dialog is open. */
export const shownChange: Signal<ChangeFlow | null> = signal(null);

/** Changes under way, and those that went wrong with their dialog hidden. */
export const begun: Signal<readonly ChangeFlow[]> = signal([]);

function done(flow: ChangeFlow): void {
  begun.value = begun.peek().filter(one => one !== flow);
}

/** Whether a change is under way on one of these servos. The rows tell of an edit themselves. */
export function underWay(uids: readonly string[]): boolean {
  return begun.value.some(
    flow =>
      flow.request.kind !== "apply" &&
      flow.phase.value === "running" &&
      flow.uids.some(uid => uids.includes(uid)),
  );
}

/** Has the server check a change, and opens its dialog. Answers why not, in words, or null. */
export async function beginChange(
  request: ChangeRequest,
  flow = new ChangeFlow(request),
): Promise<string | null> {
  await flow.look();
  const parts = flow.parts.peek();
  const asks = flow.asked.peek().length > 0 || request.other !== undefined;
  const [first] = parts ?? [];
  const refused = flow.problem.peek() ?? (parts?.every(one => one.problem) ? first?.problem : null);
  if (refused && !asks) {
    const name = (parts?.length ?? 0) > 1 && first ? `${nameOf(peekServo(first.uid))}: ` : "";
    return name + problemText(refused);
  }
  shownChange.value = flow;
  return null;
}

/** Opens the dialog of a change that is planned there. */
export function openChange(request: ChangeRequest): ChangeFlow {
  const flow = new ChangeFlow(request);
  shownChange.value = flow;
  return flow;
}

/** Does a change that asks nothing beforehand; the dialog opens only where the server wants something confirmed. */
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
