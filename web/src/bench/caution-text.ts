/** What to know before a command, in the page's language; the server's sentence where the page has none. */
import type { Caution } from "../api/types";
import { codes } from "./codes";
import { factsOf } from "./facts";
import { nameOf, servo } from "./fleet";

export function cautionText(one: Caution, uid: string): string {
  return (
    codes.value.cautions?.[one.code]?.({ ...factsOf(one.params), servo: nameOf(servo(uid)) }) ?? one.text
  );
}
