/** The Stop button: acts on press, without a question, always present. */
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { stop, stopped } from "../bench/bench";
import { uids } from "../bench/fleet";
import { escapeArmed } from "../bench/keys";
import { link } from "../bench/link";
import { motionOn, movingNow } from "../bench/moving";
import { page } from "../bench/route";
import { phone } from "../bench/screen";
import { severalBenches, thisBench } from "../bench/site";
import { pressStop } from "../bench/stop";
import { watchStop } from "../bench/stop-sight";
import { text } from "../text";

const pressed = signal(false);

export function StopButton() {
  const latched = stopped.value;
  const down = link.value.state === "down";
  const word = down ? text.stop.noLink : latched ? text.stop.stopped : text.stop.word;
  const reach = stop.value?.reach ?? "all";
  const under = down
    ? text.stop.cut
    : reach === "none"
      ? text.stop.sendsNothing
      : latched
        ? text.stop.again
        : reach === "own"
          ? text.stop.reaches(stop.value?.reaches.length ?? 0, uids.value.length)
          : page.value === "site" && severalBenches.value
            ? text.stop.benchOnly(thisBench.value?.name ?? "")
            : phone.value
              ? everyServo()
              : keys();
  const button = useRef<HTMLButtonElement>(null);
  useEffect(() => watchStop(button.current), []);
  const press = (event: PointerEvent) => {
    if (event.button !== 0) return;
    pressed.value = true;
    pressStop("button");
  };
  return (
    <button
      ref={button}
      type="button"
      class="stop"
      data-testid="stop"
      data-latched={latched}
      data-link={link.value.state}
      data-reach={reach}
      data-pressed={pressed.value}
      aria-label={`${word}. ${text.stop.label}`}
      onPointerDown={press}
      onPointerUp={release}
      onPointerLeave={release}
      onPointerCancel={release}
      onClick={event => {
        // A click without a pointer: Enter or Space on the focused button, or assistive technology.
        if (event.detail === 0) pressStop("button");
      }}
    >
      <span>
        <Octagon />
        <span>
          <b>{word}</b>
          <small class={latched || down || phone.value || reach !== "all" ? "" : "keys"}>{under}</small>
        </span>
      </span>
    </button>
  );
}

/** The keys that stop now. */
function keys(): string {
  const words = text.stop.keys;
  if (motionOn()) return words.on;
  if (movingNow.value) return words.moving;
  return escapeArmed.value ? words.again : words.still;
}

function everyServo(): string {
  const known = uids.value.length;
  return known === 0 ? text.stop.label : text.stop.reach(known);
}

function release(): void {
  pressed.value = false;
}

function Octagon() {
  return (
    <svg class="icon" width="30" height="30" viewBox="0 0 30 30" aria-hidden="true">
      <path
        d="M9.4 1.5h11.2l7.9 7.9v11.2l-7.9 7.9H9.4L1.5 20.6V9.4z"
        fill="none"
        stroke="currentColor"
        stroke-width="2.2"
      />
      <path d="M10.5 10.5h9v9h-9z" fill="currentColor" />
    </svg>
  );
}
