/** Text of the doctor's findings by code. English text comes from the server, except remedies that name a button or tab. */
import type { Advice, FindingCode } from "../api/bus-types";
import type { RefusalCode } from "../api/types";
import type { FactsText } from "../bench/facts";

type Sayings<Code extends string> = Readonly<Partial<Record<Code, FactsText>>>;

/** Titles and evidence of passed checks and of problems, remedies, and reasons why a node gets no node ID. */
export const words: {
  readonly well: Sayings<FindingCode>;
  readonly wrong: Sayings<FindingCode>;
  readonly evidence: { readonly well: Sayings<FindingCode>; readonly wrong: Sayings<FindingCode> };
  readonly remedy: Sayings<Advice>;
  readonly refusal: Sayings<RefusalCode>;
} = {
  well: {},
  wrong: {},
  evidence: { well: {}, wrong: {} },
  refusal: {},
  remedy: {
    connect_adapter: () => "Choose an adapter and connect it.",
    set_bit_timing: p =>
      p.command ??
      (p.sample_point_pct === undefined
        ? "Reconnect the adapter at 1 Mbit/s."
        : "Reconnect the adapter with a sample point of 87.5 %."),
    check_adapter: () => "Check the adapter and its cable, then reconnect.",
    check_timing_and_wiring: () => "Check bit rate, wiring and termination, then reconnect.",
    keep_one_allocator: () =>
      "Turn off one of the two allocators: the other one, or hornbill's under Node IDs.",
    turn_allocator_on: () => "Turn on the allocator under Node IDs.",
    free_node_id: () => "Check the assignments under Node IDs. Forget frees a node ID.",
  },
};
