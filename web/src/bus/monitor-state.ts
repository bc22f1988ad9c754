/** The frame monitor: what is subscribed to, the filter, and the counts as they are told. */

import { batch, computed, effect, signal } from "@preact/signals";
import type { FrameFilter } from "../api/bus-types";
import { monotonic } from "../bench/clock";
import { failureText } from "../bench/facts";
import { connection, live, onFrames, onRefusal, up } from "../bench/link";
import { oneInAddress } from "../bench/route";
import { type Counts, FrameFeed } from "../telemetry/frame-feed";
import { EVERYTHING, parseFilter } from "./frame-filter";

/** Rows kept to scroll back in; only those in sight are elements. */
const CAPACITY = 1000;

export const feed = new FrameFeed(CAPACITY);

/** What stands in the filter box. */
export const box = signal("");
export const view = oneInAddress<NonNullable<FrameFilter["view"]>>("view", ["decoded", "raw"]);

const parsed = computed(() => parseFilter(box.value));

/** Why the filter box cannot be used; what was set before stays in force then. */
export const filterProblem = computed(() => parsed.value.problem);

/** What the server said of our subscription, if it refused it. */
export const monitorRefusal = signal<string | null>(null);

export const counts = signal<Counts>(feed.counts);

/** Our monotonic time at which what is shown now was asked for. */
export const askedAt = signal(0);

/** Each of these alone keeps the list as it is: the button, somebody scrolled back, a row whose details are shown. */
export const paused = signal(false);
export const scrolled = signal(false);
export const chosenFrame = signal<number | null>(null);

/** Our monotonic time since when the list is held; null while it follows. */
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

/** Follows again, whatever held it. */
export function goOn(): void {
  batch(() => {
    paused.value = false;
    scrolled.value = false;
    chosenFrame.value = null;
  });
}

const TYPING_MS = 250;
const COUNT_MS = 200;

/** Subscribes while the tab is seen, anew after each connection and change of the filter; the answer ends it. */
export function watchFrames(): () => void {
  const seen = signal(!document.hidden);
  const look = () => {
    seen.value = !document.hidden;
  };
  document.addEventListener("visibilitychange", look);

  // The last filter that could be read, settled for a moment: nobody types as fast as that.
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
  let asked = false;
  const endSubscribing = effect(() => {
    if (!up.value || !seen.value || connection.value === 0) return undefined;
    const filter: FrameFilter = { ...JSON.parse(settled.value), view: view.value };
    feed.clear();
    goOn();
    monitorRefusal.value = null;
    askedAt.value = monotonic();
    asked = live.send({ type: "subscribe", topics: ["frames"], uids: null, frames: filter });
    return () => {
      live.send({ type: "unsubscribe", topics: ["frames"] });
    };
  });
  const endHearing = onFrames(message => {
    asked = false;
    feed.take(message);
  });
  const endRefusals = onRefusal(error => {
    if (asked && error.uid === null) monitorRefusal.value = failureText(error);
  });
  const told = setInterval(() => {
    counts.value = feed.counts;
    missed.value = feed.missed;
  }, COUNT_MS);
  return () => {
    clearInterval(told);
    clearTimeout(typing);
    endTyping();
    endSubscribing();
    endHearing();
    endRefusals();
    document.removeEventListener("visibilitychange", look);
    feed.clear();
    goOn();
  };
}
