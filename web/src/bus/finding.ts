/** A finding in the page's language, by its codes; the server's text where the page has none. */
import type { Finding } from "../api/bus-types";
import { type Facts, factsOf } from "../bench/facts";
import { nameOf, servo } from "../bench/fleet";
import { findingWords as words } from "./words";

export interface FindingText {
  title: string;
  evidence: string;
  remedy: string | null;
  command: unknown;
}

export function findingText(one: Finding): FindingText {
  const facts = factsIn(one);
  const kind = one.severity === "ok" ? "well" : "wrong";
  return {
    title: words[kind][one.code]?.(facts) ?? one.text,
    evidence: words.evidence[kind][one.code]?.(facts) || one.evidence,
    remedy: one.remedy && ((one.advice && words.remedy[one.advice]?.(facts)) ?? one.remedy),
    command: one.params?.command,
  };
}

/** Its values, with the servo's name as shown on this page. */
function factsIn(one: Finding): Facts {
  const facts = factsOf(one.params);
  return facts.servo === undefined
    ? facts
    : { ...facts, servo: nameOf(servo(one.uids?.[0] ?? null)) || facts.servo };
}
