/** The draft of the wizard: selected servos, their new values, and the present step; it survives a reload. */

import { signal } from "@preact/signals";
import type { Candidate, Commissioning, OnAnomaly, SafetyWord } from "../api/config-types";
import { wholeNumber } from "../bench/number";
import { readTab, writeTab } from "../bench/tab-store";
import { commission as words } from "./words";

export type Step = "find" | "identify" | "profile" | "check";

export interface Entry {
  /** As typed; checked by `wrongIds`. */
  servoId: string;
  /** As typed; "" leaves the node ID unchanged. */
  nodeId: string;
  label: string;
  state: "open" | "given" | "skipped";
}

export interface WizardDraft {
  step: Step;
  /** Selected servos, ordered by serial number. */
  chosen: readonly string[];
  entries: Readonly<Record<string, Entry>>;
  /** Free servo IDs reported by the server, one for each candidate. */
  free: readonly number[];
  /** The servo being identified. */
  at: string | null;
  profile: string | null;
  save: boolean;
  onAnomaly: OnAnomaly;
  confirm: readonly SafetyWord[];
  /** Jobs started from this draft: the first, then one for each retried servo. */
  jobs: readonly string[];
}

export const EMPTY: WizardDraft = {
  step: "find",
  chosen: [],
  entries: {},
  free: [],
  at: null,
  profile: null,
  save: true,
  onAnomaly: "stop",
  confirm: [],
  jobs: [],
};

const KEY = "hornbill.commission";
const STEPS: readonly Step[] = ["find", "identify", "profile", "check"];

export const LOWEST_ID = 1;
export const HIGHEST_ID = 254;
const HIGHEST_NODE = 125;
export const LONGEST_LABEL = 64;

/** The stored draft, or an empty one if it is not readable: another version of the page may have written it. */
export function read(kept: unknown): WizardDraft {
  try {
    const found = kept as Partial<WizardDraft> | null;
    if (!found || !STEPS.includes(found.step as Step) || !Array.isArray(found.chosen)) return EMPTY;
    const draft = { ...EMPTY, ...found };
    const whole = draft.chosen.every(uid => typeof draft.entries[uid]?.servoId === "string");
    return whole && Array.isArray(draft.jobs) ? draft : EMPTY;
  } catch {
    return EMPTY;
  }
}

export const draft = signal<WizardDraft>(read(readTab(KEY)));

export function changeDraft(part: Partial<WizardDraft>): void {
  draft.value = { ...draft.peek(), ...part };
  writeTab(KEY, draft.peek());
}

export function resetDraft(): void {
  changeDraft(EMPTY);
}

export function changeEntry(uid: string, part: Partial<Entry>): void {
  const present = draft.peek();
  const entry = present.entries[uid];
  if (entry) changeDraft({ entries: { ...present.entries, [uid]: { ...entry, ...part } }, confirm: [] });
}

export interface Chosen {
  uid: string;
  servoId: number | null;
  label: string;
}

/** The draft with these servos, with entries typed before. `at` is the first open servo. */
export function chooseServos(
  before: WizardDraft,
  servos: readonly Chosen[],
  candidates: readonly Candidate[],
): Partial<WizardDraft> {
  const entries: Record<string, Entry> = {};
  for (const one of servos) {
    const known = one.servoId !== null && one.servoId !== 0;
    entries[one.uid] = before.entries[one.uid] ?? {
      servoId: known ? String(one.servoId) : "",
      nodeId: "",
      label: one.label,
      state: "open",
    };
  }
  const chosen = servos.map(one => one.uid);
  const free = candidates.flatMap(one => (one.servo_id === null ? [] : [one.servo_id]));
  return { chosen, entries, free, at: chosen.find(uid => entries[uid]?.state === "open") ?? null };
}

/** The servo ID to propose: the lowest free one not used in the draft. "" if there is none. */
export function propose(one: WizardDraft, uid: string, taken: ReadonlySet<number>): string {
  const given = new Set(taken);
  for (const [other, entry] of Object.entries(one.entries)) {
    if (other !== uid && entry.state === "given") given.add(wholeNumber(entry.servoId) ?? 0);
  }
  const free = one.free.find(id => !given.has(id));
  if (free !== undefined) return String(free);
  for (let id = LOWEST_ID; id <= HIGHEST_ID; id++) if (!given.has(id)) return String(id);
  return "";
}

/** The next open servo after `uid`, wrapping around; null if none is open. */
export function nextOpen(one: WizardDraft, uid: string | null): string | null {
  const from = uid === null ? -1 : one.chosen.indexOf(uid);
  for (let i = 1; i <= one.chosen.length; i++) {
    const next = one.chosen[(from + i) % one.chosen.length];
    if (next !== undefined && one.entries[next]?.state === "open") return next;
  }
  return null;
}

export interface Wrong {
  servoId: string | null;
  nodeId: string | null;
}

/** Errors in the IDs of an entry. `owners`: IDs of servos that are not in the draft. */
export function wrongIds(one: WizardDraft, uid: string, owners: ReadonlyMap<number, string>): Wrong {
  const entry = one.entries[uid];
  if (!entry) return { servoId: null, nodeId: null };
  const others = Object.entries(one.entries).filter(
    ([other, held]) => other !== uid && one.chosen.includes(other) && held.state === "given",
  );
  const id = wholeNumber(entry.servoId);
  let servoId: string | null = null;
  if (id === null || id < LOWEST_ID || id > HIGHEST_ID)
    servoId = words.identify.idRange(entry.servoId.trim());
  else if (others.some(([, held]) => wholeNumber(held.servoId) === id))
    servoId = words.identify.idTwice(String(id));
  else if (owners.has(id)) servoId = words.identify.idTaken(String(id), owners.get(id) ?? "");
  let nodeId: string | null = null;
  if (entry.nodeId.trim() !== "") {
    const node = wholeNumber(entry.nodeId);
    if (node === null || node > HIGHEST_NODE) nodeId = words.identify.nodeRange(entry.nodeId.trim());
    else if (node > 0 && others.some(([, held]) => wholeNumber(held.nodeId) === node))
      nodeId = words.identify.nodeTwice(String(node));
  }
  return { servoId, nodeId };
}

export interface Count {
  given: number;
  skipped: number;
  open: number;
}

export function count(one: WizardDraft): Count {
  const found: Count = { given: 0, skipped: 0, open: 0 };
  for (const uid of one.chosen) found[one.entries[uid]?.state ?? "open"] += 1;
  return found;
}

/** UIDs of the servos to commission, in the selected order. */
export function wanted(one: WizardDraft): string[] {
  return one.chosen.filter(uid => one.entries[uid]?.state === "given");
}

/** The request body; `uids` restricts it to those servos. */
export function request(
  one: WizardDraft,
  uids: readonly string[] = wanted(one),
): Omit<Commissioning, "dry_run"> {
  return {
    servos: uids.flatMap(uid => {
      const entry = one.entries[uid];
      if (!entry) return [];
      const node = wholeNumber(entry.nodeId);
      return [{ uid, servo_id: wholeNumber(entry.servoId), node_id: node, label: entry.label.trim() }];
    }),
    profile: one.profile,
    save: one.save,
    identify: false,
    on_anomaly: one.onAnomaly,
    confirm: [...one.confirm],
  };
}
