/** Text shared by all parts of an open recording: times relative to the first mark, names of channels. */
import type { Row } from "../api/types";
import { catalog } from "../bench/catalog";
import { signed, withUnit } from "../bench/format";

/** "+3.2 s", "−40 s", "0 s": relative to the first mark. */
export function relative(s: number, decimals: number): string {
  return withUnit(signed(s, decimals), "s");
}

export function rowOf(key: string): Row | undefined {
  return catalog.value?.rows.get(key);
}

export function channelLabelOf(key: string): string {
  return rowOf(key)?.label ?? key.replaceAll("_", " ");
}
