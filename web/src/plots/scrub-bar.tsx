/** The timeline of an open recording: position by pointer and keys, and playback. */
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { clock, date, number, signed } from "../bench/format";
import { calm } from "../bench/screen";
import { Icon } from "../kit/icon";
import { everyFrame } from "./frames";
import { type Scrub, SPEEDS } from "./scrub";
import { plots } from "./words";
import "./plots.css";
import "./scrub.css";

const words = plots.scrub;
/** Draws per second of the 3D view; two with reduced motion. */
const PLAY_HZ = 25;
const CALM_HZ = 2;

interface Props {
  scrub: Scrub;
  /** Present message. */
  note?: string | null;
  /** Additional buttons. */
  children?: ComponentChildren;
}

export function ScrubBar({ scrub, note = null, children }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const playing = scrub.playing.value;
  const at = scrub.at.value;
  const { from, to } = scrub.extent;
  useEffect(() => {
    if (!playing || !box.current) return undefined;
    let before: number | null = null;
    return everyFrame(box.current, calm.peek() ? CALM_HZ : PLAY_HZ, now => {
      if (before !== null) scrub.pass(now - before);
      before = now;
    });
  }, [scrub, playing]);
  useEffect(() => () => scrub.pause(), [scrub]);
  return (
    <div ref={box} class="scrub" role="group" aria-label={words.label} data-testid="scrub" data-at={at}>
      <div class="scrub-line">
        <button
          type="button"
          class="tool scrub-play"
          data-testid="scrub-play"
          onClick={() => (playing ? scrub.pause() : scrub.play())}
        >
          <Icon name={playing ? "pause" : "play"} size={15} />
          {playing ? words.pause : words.play}
        </button>
        <label class="plot-window">
          <span class="hidden-text">{words.speed}</span>
          <select
            data-testid="scrub-speed"
            value={String(scrub.speed.value)}
            onChange={event => {
              scrub.speed.value = Number(event.currentTarget.value);
            }}
          >
            {SPEEDS.map(one => (
              <option key={one} value={String(one)}>
                {words.times(String(one))}
              </option>
            ))}
          </select>
        </label>
        {children}
        <span class="grow" />
        <span class="scrub-time" aria-hidden="true">
          <b data-testid="scrub-at">{relative(scrub, at)}</b>{" "}
          <span class="second" data-testid="scrub-wall">
            {wall(scrub, at)}
          </span>
        </span>
      </div>
      <input
        type="range"
        class="scrub-slider"
        data-testid="scrub-slider"
        min={from}
        max={to}
        step="any"
        value={at}
        aria-label={words.time}
        aria-valuetext={words.moment(relative(scrub, at), wall(scrub, at))}
        onInput={event => {
          scrub.pause();
          scrub.seek(event.currentTarget.valueAsNumber);
        }}
        onKeyDown={event => keys(event, scrub)}
      />
      {note !== null && (
        <p class="second small" data-testid="scrub-note">
          {note}
        </p>
      )}
    </div>
  );
}

function keys(event: KeyboardEvent, scrub: Scrub): void {
  if (event.altKey || event.ctrlKey || event.metaKey) return;
  const { from, to } = scrub.extent;
  const sign = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
  if (sign === undefined && event.key !== "Home" && event.key !== "End") return;
  event.preventDefault();
  scrub.pause();
  if (event.key === "Home") scrub.seek(from);
  else if (event.key === "End") scrub.seek(to);
  else if (event.shiftKey) scrub.seek(scrub.at.peek() + (sign ?? 0));
  else scrub.step(sign ?? 0);
}

function relative(scrub: Scrub, at: number): string {
  return plots.seconds(signed(at - scrub.extent.origin, 2));
}

/** Local time of the moment, or that the recording does not contain it. */
function wall(scrub: Scrub, at: number): string {
  const utc = at + scrub.extent.utc;
  if (!Number.isFinite(utc)) return words.noWall;
  // In hundredths, like the time before it: thousandths change too fast to be read.
  const cents = number(Math.floor((utc % 1) * 100), 0).padStart(2, "0");
  return `${date(utc)} ${clock(utc)}.${cents}`;
}
