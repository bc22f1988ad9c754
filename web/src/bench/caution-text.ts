/** Text of a caution before a command, in the page's language, or the server's. */
import type { Caution } from "../api/types";
import { codes } from "./codes";
import { factsOf } from "./facts";
import { nameOf, servo } from "./fleet";

export function cautionText(one: Caution, uid: string): string {
  return (
    codes.value.cautions?.[one.code]?.({ ...factsOf(one.params), servo: nameOf(servo(uid)) }) ?? one.text
  );
}
