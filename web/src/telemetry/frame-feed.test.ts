/** The monitor's rows: bounded, in order, held, and honest about what is missing. */
import { describe, expect, test } from "vitest";
import type { DecodedTransfer, FramesMessage, RawFrame } from "../api/bus-types";
import { FrameFeed } from "./frame-feed";

const frame = (timestamp: number) => ({
  timestamp,
  sent: false,
  can_id: "10015511",
  data: "",
  problem: null,
});
const transfer = (timestamp: number) => ({ timestamp, source: 1 }) as DecodedTransfer;

let received = 0;
function message(frames: RawFrame[], transfers: DecodedTransfer[] = [], dropped = 0): FramesMessage {
  received += frames.length + transfers.length;
  return { type: "frames", seq: 1, received, shown: received, dropped, frames, transfers };
}

const times = (feed: FrameFeed) => {
  const out: (number | string)[] = [];
  for (let number = feed.first; number < feed.end; number++) {
    const row = feed.at(number);
    out.push(row?.kind === "gap" ? `lost ${row.lost}, held ${row.held}` : (row?.at ?? Number.NaN));
  }
  return out;
};

describe("FrameFeed", () => {
  test("keeps the newest, and its numbers go on", () => {
    const feed = new FrameFeed(3);
    feed.take(message([frame(1), frame(2)]));
    expect(times(feed)).toEqual([1, 2]);
    feed.take(message([frame(3), frame(4), frame(5)]));
    expect(times(feed)).toEqual([3, 4, 5]);
    expect([feed.first, feed.end]).toEqual([2, 5]);
    expect(feed.at(1)).toBeUndefined();
    expect(feed.at(5)).toBeUndefined();
  });

  test("stays bounded whatever comes, with more than it holds in one message too", () => {
    const feed = new FrameFeed(300);
    for (let i = 0; i < 50; i++)
      feed.take(message(Array.from({ length: 400 }, (_, place) => frame(i * 400 + place))));
    expect(feed.end - feed.first).toBe(300);
    expect(feed.at(feed.end - 1)?.at).toBe(50 * 400 - 1);
    expect(feed.at(feed.first)?.at).toBe(50 * 400 - 300);
  });

  test("frames and transfers of a message are put in the order of their time", () => {
    const feed = new FrameFeed(10);
    feed.take(message([frame(2), frame(5)], [transfer(1), transfer(3), transfer(2.5)]));
    expect(times(feed)).toEqual([1, 2, 2.5, 3, 5]);
  });

  test("what was lost on the way stands between the rows, once however many messages in a row lost some", () => {
    const feed = new FrameFeed(10);
    feed.take(message([frame(1)], [], 0));
    feed.take(message([frame(2)], [], 7));
    feed.take(message([], [], 9));
    feed.take(message([frame(3)], [], 9));
    expect(times(feed)).toEqual([1, 2, "lost 9, held 0", 3]);
    expect(feed.counts.lost).toBe(9);
  });

  test("paused, rows stay and the counts go on; resumed, a row says how much is missing", () => {
    const feed = new FrameFeed(10);
    feed.take(message([frame(1)]));
    feed.hold();
    feed.take(message([frame(2), frame(3)]));
    expect(times(feed)).toEqual([1]);
    expect(feed.missed).toBe(2);
    expect(feed.counts.received).toBe(received);
    feed.release();
    feed.take(message([frame(4)]));
    expect(times(feed)).toEqual([1, "lost 0, held 2", 4]);
    expect(feed.missed).toBe(0);
  });

  test("paused and resumed without missed frames leaves no gap", () => {
    const feed = new FrameFeed(10);
    feed.take(message([frame(1)]));
    feed.hold();
    feed.release();
    feed.take(message([frame(2)]));
    expect(times(feed)).toEqual([1, 2]);
  });

  test("cleared it is empty, counts from nothing, and its numbers are not used again", () => {
    const feed = new FrameFeed(10);
    feed.take(message([frame(1)], [], 5));
    const { end } = feed;
    feed.clear();
    expect(feed.end - feed.first).toBe(0);
    expect(feed.counts).toEqual({ received: 0, shown: 0, lost: 0 });
    feed.take(message([frame(2)], [], 0));
    expect(times(feed)).toEqual([2]);
    expect(feed.first).toBe(end);
  });

  test("without room for a row it is refused", () => {
    expect(() => new FrameFeed(0)).toThrow(RangeError);
  });
});
