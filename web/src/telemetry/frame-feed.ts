/** Rows of the monitor: the newest rows of topic `frames`, bounded, with the gaps between them. */
import type { DecodedTransfer, FramesMessage, RawFrame } from "../api/bus-types";

export type FeedRow =
  | { kind: "transfer"; at: number; transfer: DecodedTransfer }
  | { kind: "frame"; at: number; frame: RawFrame }
  /** Rows that passed the filter but are missing: lost, or received while paused. */
  | { kind: "gap"; at: number; lost: number; held: number };

export interface Counts {
  received: number;
  shown: number;
  lost: number;
}

const NOTHING: Counts = { received: 0, shown: 0, lost: 0 };

/**
 * Rows are numbered from 0 in the order of arrival; `first` is the oldest stored row and `end` the next one.
 * While paused only the counts change.
 */
export class FrameFeed {
  readonly capacity: number;
  #rows: (FeedRow | undefined)[];
  #end = 0;
  #first = 0;
  #held = false;
  #missed = 0;
  #dropped = 0;
  counts: Counts = NOTHING;

  constructor(capacity: number) {
    if (!Number.isInteger(capacity) || capacity < 1) throw new RangeError("a feed needs room for a row");
    this.capacity = capacity;
    this.#rows = new Array(capacity);
  }

  get first(): number {
    return this.#first;
  }

  get end(): number {
    return this.#end;
  }

  get held(): boolean {
    return this.#held;
  }

  /** Number of rows received while paused. */
  get missed(): number {
    return this.#missed;
  }

  at(number: number): FeedRow | undefined {
    return number < this.#first || number >= this.#end ? undefined : this.#rows[number % this.capacity];
  }

  take(message: FramesMessage): void {
    const lost = Math.max(0, message.dropped - this.#dropped);
    this.#dropped = message.dropped;
    this.counts = { received: message.received, shown: message.shown, lost: message.dropped };
    if (this.#held) {
      this.#missed += message.frames.length + message.transfers.length + lost;
      return;
    }
    for (const row of merged(message)) this.#push(row);
    if (lost > 0) this.#gap(lost, 0);
  }

  /** Pause: the stored rows do not change. */
  hold(): void {
    this.#held = true;
  }

  /** Resume; rows received meanwhile are dropped, and a gap row says how many. */
  release(): void {
    if (!this.#held) return;
    this.#held = false;
    if (this.#missed > 0) this.#gap(0, this.#missed);
    this.#missed = 0;
  }

  /** Clear rows and counts, as after a new subscription. */
  clear(): void {
    this.#first = this.#end;
    this.#missed = 0;
    this.#dropped = 0;
    this.counts = NOTHING;
  }

  #push(row: FeedRow): void {
    this.#rows[this.#end % this.capacity] = row;
    this.#end += 1;
    this.#first = Math.max(this.#first, this.#end - this.capacity);
  }

  /** Merges consecutive gaps. */
  #gap(lost: number, held: number): void {
    const last = this.at(this.#end - 1);
    if (last?.kind === "gap") {
      last.lost += lost;
      last.held += held;
    } else this.#push({ kind: "gap", at: last?.at ?? 0, lost, held });
  }
}

/** Frames and transfers of one message in chronological order. */
function merged({ frames, transfers }: FramesMessage): FeedRow[] {
  const rows: FeedRow[] = [
    ...frames.map(frame => ({ kind: "frame", at: frame.timestamp, frame }) as const),
    ...transfers.map(transfer => ({ kind: "transfer", at: transfer.timestamp, transfer }) as const),
  ];
  return rows.sort((one, other) => one.at - other.at);
}
