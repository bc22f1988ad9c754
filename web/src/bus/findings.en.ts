/** What the doctor's findings say, by code. In English the server says it, but for what is a button or a tab here. */
import type { Advice, FindingCode } from "../api/bus-types";
import type { Saying } from "../bench/facts";

type Sayings<Code extends string> = Readonly<Partial<Record<Code, Saying>>>;

/** Titles and evidence of what is well and of what is wrong, and remedies. */
export const words: {
  readonly well: Sayings<FindingCode>;
  readonly wrong: Sayings<FindingCode>;
  readonly evidence: { readonly well: Sayings<FindingCode>; readonly wrong: Sayings<FindingCode> };
  readonly remedy: Sayings<Advice>;
} = {
  well: {},
  wrong: {},
  evidence: { well: {}, wrong: {} },
  remedy: {
    connect_adapter: () => "Choose an adapter, and connect it.",
    set_bit_timing: p =>
      p.command ??
      (p.sample_point_pct === undefined
        ? "Connect the adapter again, at 1 Mbit/s."
        : "Connect the adapter again, with a sample point of 87.5 %."),
    check_adapter: () => "Check the adapter and its cable, then connect again.",
    check_timing_and_wiring: () => "Check bit rate, wiring and termination, then connect again.",
    keep_one_allocator: () => "Keep one of the two: switch the other off, or ours under Node IDs.",
    turn_allocator_on: () => "Turn it on under Node IDs.",
    free_node_id: () => "See under Node IDs who has which; Forget frees one.",
  },
};
