/** The event line at the foot, and the log that it opens. */
import { useSignal } from "@preact/signals";
import { type BenchEvent, events } from "../bench/bench";
import type { ConditionKind } from "../bench/condition";
import { eventText } from "../bench/event-text";
import { clock } from "../bench/format";
import { session } from "../bench/session";
import { Glyph } from "../kit/glyph";
import { lazy } from "../kit/lazy";
import { text } from "../text";

const SignedIn = lazy(() => import("../login/page").then(file => file.SignedIn));

const KIND: Record<BenchEvent["level"], ConditionKind | null> = {
  info: null,
  notice: "notice",
  warning: "warning",
  failure: "failure",
};

export function Foot() {
  const open = useSignal(false);
  const latest = events.value[0];
  const flip = () => {
    open.value = !open.value;
  };
  return (
    <footer class="foot">
      {open.value && (
        <ol class="event-log" id="event-log">
          {events.value.map((event, place) => (
            <li key={`${event.at}/${events.value.length - place}`}>
              <Line event={event} />
            </li>
          ))}
        </ol>
      )}
      <div class="foot-line">
        <span class="strong touch-hide">{text.events.title}</span>
        {latest && <time class="mono dim touch-hide">{clock(latest.at, true)}</time>}
        <span class="latest second" aria-live="polite" data-testid="event-line">
          {latest ? eventText(latest) : text.events.none}
        </span>
        {events.value.length > 0 && (
          <button
            type="button"
            class="link"
            aria-expanded={open.value}
            aria-controls="event-log"
            onClick={flip}
          >
            {open.value ? text.events.hide : text.events.all(events.value.length)}
          </button>
        )}
        {session.value?.name && <SignedIn />}
      </div>
    </footer>
  );
}

function Line({ event }: { event: BenchEvent }) {
  const kind = KIND[event.level];
  return (
    <>
      <time class="mono dim">{clock(event.at, true)}</time>
      <span class="event-kind">{kind && <Glyph kind={kind} />}</span>
      <span>{eventText(event)}</span>
    </>
  );
}
