/** The Servos page without servos: evidence, what to check, and the button to connect an adapter. */

import { callApi } from "../api/client";
import type { Bus } from "../api/types";
import { bus, connected } from "../bench/bench";
import { connectOpen } from "../bench/connect-open";
import { causeText } from "../bench/facts";
import { pending, replaceAll } from "../bench/fleet";
import { number } from "../bench/format";
import { Button } from "../kit/button";
import { Dial } from "../kit/dial";
import { Guides } from "../kit/guide";
import { text } from "../text";

export function EmptyServos({ loading }: { loading: boolean }) {
  const state = bus.value;
  if (loading) return <p class="notice-line">{text.empty.loading}</p>;
  const look = async () => {
    try {
      bus.value = await callApi("GET", "/bus");
      replaceAll(await callApi("GET", "/servos"));
    } catch {
      // The band above reports the lost link.
    }
  };
  return (
    <section class="empty" data-testid="no-servos">
      <Dial size={120} angle={0} stale />
      <div>
        <h2>{text.empty.title}</h2>
        <p class="strong">
          {connected.value && state
            ? text.empty.evidence(number(state.rx_fps, 0), String(state.errors))
            : why(state)}
        </p>
        <ul>
          {connected.value ? (
            <>
              {pending.value.length > 0 && <li>{text.empty.waiting}</li>}
              <li>{text.empty.supply}</li>
              <li>{text.empty.termination}</li>
              <li>{text.empty.bitrate}</li>
            </>
          ) : (
            <li>{text.empty.pick}</li>
          )}
        </ul>
        {connected.value ? (
          <Button live onClick={() => void look()}>
            {text.empty.again}
          </Button>
        ) : (
          <Connect />
        )}
        <Guides places={connected.value ? ["tutorial", "recover"] : ["tutorial", "adapters"]} />
      </div>
    </section>
  );
}

/** Connect button while servos are known from before. */
export function Reconnect() {
  return (
    <section class="reconnect">
      <p class="strong">{why(bus.value)}</p>
      <Connect />
    </section>
  );
}

function why(state: Bus | null): string {
  if (state?.state !== "lost") return text.empty.noBus;
  return state.trouble === null ? text.empty.lostBus : causeText(state.trouble_params, state.trouble);
}

function Connect() {
  return (
    <Button
      live
      look="primary"
      testid="open-connect"
      onClick={() => {
        connectOpen.value = true;
      }}
    >
      {text.empty.connect}
    </Button>
  );
}
