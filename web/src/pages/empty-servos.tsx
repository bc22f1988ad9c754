/** Owns what the Servos page says while there is no servo: the evidence, what to check, the adapter to connect. */
import { useSignal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Bus, Servo } from "../api/types";
import { number } from "../form/format";
import { bus, connected } from "../state/desk";
import { pending, replaceAll } from "../state/fleet";
import { text } from "../text/en";
import { Button } from "../ui/button";
import { Dial } from "../ui/dial";
import { Glyph } from "../ui/glyph";

export function EmptyServos({ loading }: { loading: boolean }) {
  const state = bus.value;
  if (loading) return <p class="notice-line">{text.empty.loading}</p>;
  const look = async () => {
    try {
      bus.value = await ask<Bus>("GET", "/bus");
      replaceAll(await ask<Servo[]>("GET", "/servos"));
    } catch {
      // The band above says that there is no link.
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
            : text.empty.noBus}
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
      </div>
    </section>
  );
}

/** The way back to a bus while servos are known from before. */
export function Reconnect() {
  return (
    <section class="reconnect">
      <p class="strong">{text.empty.noBus}</p>
      <p class="second">{text.empty.pick}</p>
      <Connect />
    </section>
  );
}

function Connect() {
  const address = useSignal(bus.peek()?.address ?? "");
  const busy = useSignal(false);
  const problem = useSignal<string | null>(null);
  const connect = async () => {
    busy.value = true;
    problem.value = null;
    try {
      bus.value = await ask<Bus>("PUT", "/bus", { body: { address: address.peek().trim() } });
    } catch (error) {
      problem.value = text.problem(problemOf(error));
    } finally {
      busy.value = false;
    }
  };
  return (
    <form
      class="connect"
      onSubmit={event => {
        event.preventDefault();
        void connect();
      }}
    >
      <label>
        <span class="hidden-text">{text.empty.adapter}</span>
        <input
          class="field"
          data-testid="adapter"
          placeholder={text.empty.example}
          autocomplete="off"
          value={address.value}
          onInput={event => {
            address.value = event.currentTarget.value;
          }}
        />
      </label>
      <Button
        live
        look="primary"
        testid="connect"
        disabled={busy.value || address.value.trim() === ""}
        onClick={() => void connect()}
      >
        {busy.value ? text.empty.connecting : text.empty.connect}
      </Button>
      {problem.value && (
        <p class="refusal" role="alert">
          <Glyph kind="failure" size={14} /> {problem.value}
        </p>
      )}
    </form>
  );
}
