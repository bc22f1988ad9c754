/** Head of the Bus page: adapter and state, and buttons to change them. */

import { useSignal } from "@preact/signals";
import { callApi } from "../api/client";
import type { Bus } from "../api/types";
import { bus } from "../bench/bench";
import { channelOf, retryIn } from "../bench/bus-now";
import { connectOpen } from "../bench/connect-open";
import { causeText } from "../bench/facts";
import { number, size, withUnit } from "../bench/format";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { text } from "../text";
import { lineFact, nothingReceived } from "./line";
import { log } from "./log";
import { LogDialog } from "./log-dialog";
import { Remedy } from "./remedy";
import { busWords as words } from "./words";

export function BusHead() {
  const open = useSignal<"none" | "disconnect" | "log">("none");
  const state = bus.value;
  const name = channelOf(state?.address);
  const none = state === null || state.state === "disconnected";
  const close = () => {
    open.value = "none";
  };
  return (
    <>
      <div class="page-head bus-head">
        <div class="bus-name">
          <h1>{name === "" ? words.unnamed : words.title(name)}</h1>
          <span class="second bus-facts" data-testid="bus-facts">
            {state && facts(state)}
          </span>
        </div>
        {!none && (
          <Button
            look="danger"
            live
            testid="bus-disconnect"
            onClick={() => {
              open.value = "disconnect";
            }}
          >
            {words.disconnect}
          </Button>
        )}
        {!none && (
          <Button
            live
            testid="bus-change"
            onClick={() => {
              connectOpen.value = true;
            }}
          >
            {words.change}
          </Button>
        )}
        <Button
          testid="bus-log"
          onClick={() => {
            open.value = "log";
          }}
        >
          {log.value?.state === "running" ? (
            <>
              <span class="k-intent" aria-hidden="true">
                ●
              </span>
              {words.logging(size(log.value.bytes))}
            </>
          ) : (
            <>
              <Icon name="download" />
              {words.log}
            </>
          )}
        </Button>
      </div>
      {state && <Trouble state={state} />}
      {open.value === "disconnect" && <DisconnectDialog name={name} onClose={close} />}
      {open.value === "log" && <LogDialog onClose={close} />}
    </>
  );
}

function facts(state: Bus): string {
  const word = stateWord(state);
  if (state.state === "disconnected" || state.bitrate === null) return word;
  const rate = text.bar.bitrate(number(state.bitrate / 1e6, state.bitrate % 1e6 ? 3 : 0));
  const point =
    state.sample_point === null
      ? words.samplePointUnknown
      : words.samplePoint(withUnit(number(state.sample_point * 100, 1), "%"));
  const line = lineFact(state);
  const facts = `${word}${text.period}${rate}${text.comma}${point}`;
  return line === null ? facts : `${facts}${text.period}${line}`;
}

function stateWord(state: Bus): string {
  if (state.trouble_code === "recording_over") return words.trouble.over;
  return state.trouble_code === "nothing_received" ? words.trouble.nothing : words.state[state.state];
}

/** Why the bus does not work, the remedy, and the time of the next retry. */
function Trouble({ state }: { state: Bus }) {
  const waits = retryIn.value;
  if (state.trouble === null && state.state !== "lost" && state.state !== "bus_off") return null;
  const nothing = state.trouble_code === "nothing_received" ? nothingReceived(state) : null;
  return (
    <section class="bus-trouble" role="alert" data-testid="bus-trouble">
      <Glyph kind={state.state === "passive" || state.state === "active" ? "warning" : "failure"} />
      <div>
        <p class="strong">{stateWord(state)}</p>
        {nothing?.map(one => (
          <p key={one}>{one}</p>
        ))}
        {nothing === null && state.trouble !== null && (
          <Remedy
            text={causeText(state.trouble_params, state.trouble)}
            command={state.trouble_params.command}
          />
        )}
      </div>
      {waits !== null && (
        // Announced once, not each second.
        <p class="second retry" aria-live="off" data-testid="bus-retry">
          {waits < 0.1 && <Spinner size={14} />}
          {waits < 0.1
            ? words.trouble.retrying
            : words.trouble.retry(withUnit(number(Math.ceil(waits), 0), "s"))}
        </p>
      )}
    </section>
  );
}

function DisconnectDialog({ name, onClose }: { name: string; onClose: () => void }) {
  const strings = words.disconnectDialog;
  return (
    <Confirm
      title={strings.title(name)}
      verb={strings.confirm(name)}
      danger
      testid="disconnect-dialog"
      actId="disconnect-confirm"
      act={async () => {
        bus.value = await callApi("DELETE", "/bus");
      }}
      onClose={onClose}
    >
      <p class="strong">{strings.first}</p>
      <p>{strings.after}</p>
      <p class="second">{strings.stays}</p>
    </Confirm>
  );
}
