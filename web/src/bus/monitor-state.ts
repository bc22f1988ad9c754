/** State of the frame monitor: subscription, filter and counts. */

import { batch, computed, effect, signal } from "@preact/signals";
import type { FrameFilter } from "../api/bus-types";
import { monotonic } from "../bench/clock";
import { failureText } from "../bench/facts";
import { connection, live, onFrames, onRefusal, up } from "../bench/link";
import { oneInAddress } from "../bench/route";
import { type Counts, FrameFeed } from "../telemetry/frame-feed";
import { EVERYTHING, parseFilter } from "./frame-filter";

/** Rows stored for scrolling back; only visible ones are elements. */
const CAPACITY = 1000;

export const feed = new FrameFeed(CAPACITY);

/** Text of the filter box. */
export const box = signal("");
export const view = oneInAddress<NonNullable<FrameFilter["view"]>>("view", ["decoded", "raw"]);

const parsed = computed(() => parseFilter(box.value));

/** The error in the filter box; the previous filter stays active meanwhile. */
export const filterProblem = computed(() => parsed.value.problem);

/** Why the server refused the subscription. */
export const monitorRefusal = signal<string | null>(null);

export const counts = signal<Counts>(feed.counts);

/** Monotonic time of the current subscription. */
export const subscribedAt = signal(0);

/** Each of these pauses the list: the button, scrolling back, a row with open details. */
export const paused = signal(false);
export const scrolled = signal(false);
export const chosenFrame = signal<number | null>(null);

/** Monotonic time at which the list was paused; null while it follows. */
export const heldSince = signal<number | null>(null);
export const missed = signal(0);

effect(() => {
  if (paused.value || scrolled.value || chosenFrame.value !== null) {
    feed.hold();
    heldSince.value = heldSince.peek() ?? monotonic();
  } else {
    feed.release();
    heldSince.value = null;
    missed.value = 0;
  }
});

/** Follows again, whatever paused the list. */
export function followFrames(): void {
  batch(() => {
    paused.value = false;
    scrolled.value = false;
    chosenFrame.value = null;
  });
}

const TYPING_MS = 250;
const COUNT_MS = 200;

/** Subscribes while the tab is visible, again after each connection and filter change. Returns a function that ends it. */
export function watchFrames(): () => void {
  const seen = signal(!document.hidden);
  const onVisibility = () => {
    seen.value = !document.hidden;
  };
  document.addEventListener("visibilitychange", onVisibility);

  // The last valid filter, applied when typing pauses.
  const settled = signal<string>(JSON.stringify(parsed.peek().filter ?? EVERYTHING));
  let typing: ReturnType<typeof setTimeout> | undefined;
  const endTyping = effect(() => {
    const next = parsed.value.filter;
    clearTimeout(typing);
    if (next) {
      typing = setTimeout(() => {
        settled.value = JSON.stringify(next);
      }, TYPING_MS);
    }
  });
  let subscribing = false;
  const endSubscribing = effect(() => {
    if (!up.value || !seen.value || connection.value === 0) return undefined;
    const filter: FrameFilter = { ...JSON.parse(settled.value), view: view.value };
    feed.clear();
    followFrames();
    monitorRefusal.value = null;
    subscribedAt.value = monotonic();
    subscribing = live.send({ type: "subscribe", topics: ["frames"], uids: null, frames: filter });
    return () => {
      live.send({ type: "unsubscribe", topics: ["frames"] });
    };
  });
  const endFrames = onFrames(message => {
    subscribing = false;
    feed.take(message);
  });
  const endRefusals = onRefusal(error => {
    if (subscribing && error.uid === null) monitorRefusal.value = failureText(error);
  });
  const counting = setInterval(() => {
    counts.value = feed.counts;
    missed.value = feed.missed;
  }, COUNT_MS);
  return () => {
    clearInterval(counting);
    clearTimeout(typing);
    endTyping();
    endSubscribing();
    endFrames();
    endRefusals();
    document.removeEventListener("visibilitychange", onVisibility);
    feed.clear();
    followFrames();
  };
}
