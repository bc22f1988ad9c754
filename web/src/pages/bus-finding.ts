/** Owns a finding in the page's language, by its code; the server's sentence where the page has none. */
import type { Finding } from "../api/bus-types";
import { nameOf, servo } from "../state/fleet";
import { bus, findings as said } from "../text/topics";

export interface Told {
  title: string;
  remedy: string | null;
}

export function told(one: Finding): Told {
  if (one.severity === "ok") return { title: said.well[one.code] ?? one.text, remedy: one.remedy };
  const facts = factsOf(one);
  const kind = kindOf(one, facts);
  return {
    title: fill(said.wrong[kind], facts) ?? one.text,
    remedy: one.remedy && (said.remedy[kind] ?? remedyHere(one.code, one.remedy)),
  };
}

type Facts = Record<string, string | undefined>;

/** What a finding names besides its sentences; a servo is named only while the fleet knows it. */
function factsOf(one: Finding): Facts {
  const nodes = one.node_ids ?? [];
  return {
    node: nodes[0]?.toString(),
    count: nodes.length > 0 ? String(nodes.length) : undefined,
    servo: nameOf(servo(one.uids?.[0] ?? null)) || undefined,
  };
}

/** Its code; where one code has several sentences, what else it says tells them apart. */
function kindOf(one: Finding, facts: Facts): string {
  if (one.code === "bus_off" && one.severity === "warning") return "bus_was_off";
  if (one.code === "allocation_stuck" && facts.node) return "node_id_not_taken";
  if (one.code === "silent_node" && facts.servo) return "silent_servo";
  return one.code;
}

/** A sentence with its facts; null without one of them, as half a sentence would mislead. */
function fill(sentence: string | undefined, facts: Facts): string | null {
  const slots = sentence?.match(/(?<=\{)\w+(?=\})/g) ?? [];
  if (sentence === undefined || slots.some(slot => facts[slot] === undefined)) return null;
  return sentence.replace(/\{(\w+)\}/g, (_, slot: string) => facts[slot] ?? "");
}

/** The doctor speaks to programs as well: a remedy that is a request is a button or a tab here. */
function remedyHere(code: string, remedy: string): string {
  return remedy.includes("/api/v1/") ? (bus.doctor.here[code] ?? remedy) : remedy;
}
