/** A finding in the page's language, by its codes; the server's sentence where the page has none. */
import type { Finding } from "../api/bus-types";
import { type Facts, factsOf } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { findingWords as said } from "./words";

export interface Told {
  title: string;
  evidence: string;
  remedy: string | null;
  command: unknown;
}

export function told(one: Finding): Told {
  const facts = factsIn(one);
  const kind = one.severity === "ok" ? "well" : "wrong";
  return {
    title: said[kind][one.code]?.(facts) ?? one.text,
    evidence: said.evidence[kind][one.code]?.(facts) || one.evidence,
    remedy: one.remedy && ((one.advice && said.remedy[one.advice]?.(facts)) ?? one.remedy),
    command: one.params?.command,
  };
}

/** Its values; a servo has the name that this page knows. */
function factsIn(one: Finding): Facts {
  const facts = factsOf(one.params);
  return facts.servo === undefined
    ? facts
    : { ...facts, servo: nameOf(servo(one.uids?.[0] ?? null)) || facts.servo };
}
