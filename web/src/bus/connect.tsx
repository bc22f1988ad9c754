/** The Connect dialog, and the same choice inside the Bus page while no bus is connected. */
import { useEffect } from "preact/hooks";
import type { Bus } from "../api/types";
import { bus } from "../bench/bench";
import { channelOf } from "../bench/bus-now";
import { connectOpen } from "../bench/connect-open";
import { findings, watchDoctor } from "../bench/doctor";
import { Dialog, Quit } from "../kit/dialog";
import { text } from "../text";
import { Findings } from "./doctor";
import { ConnectButton, isDemo, type Picker, PickerCards, usePicker } from "./picker";
import { busWords as words } from "./words";
import "./bus.css";
import "./connect.css";

const strings = words.connectDialog;

export function ConnectDialog() {
  const picker = usePicker();
  const close = () => {
    connectOpen.value = false;
  };
  const state = bus.value;
  return (
    <Dialog
      title={strings.title}
      subtitle={subtitle(state)}
      testid="connect-dialog"
      onClose={close}
      foot={
        <>
          <Quit onClose={close} word={text.cancel} />
          <ConnectButton picker={picker} onOpen={close} />
        </>
      }
    >
      <PickerCards picker={picker} />
      <NothingUsable picker={picker} />
    </Dialog>
  );
}

function subtitle(state: Bus | null): string {
  if (!state?.address || state.state === "disconnected") return strings.none;
  const name = channelOf(state.address);
  return state.state === "lost" || state.state === "connecting" ? strings.lost(name) : strings.now(name);
}

export function ConnectHere() {
  const picker = usePicker();
  return (
    <section class="connect-here" data-testid="connect-here">
      <h2>{strings.title}</h2>
      <PickerCards picker={picker} />
      <div class="connect-foot">
        <ConnectButton picker={picker} />
      </div>
    </section>
  );
}

/** No usable adapter: shows the doctor's findings. */
function NothingUsable({ picker }: { picker: Picker }) {
  useEffect(() => watchDoctor().end, []);
  const list = picker.adapters.value;
  const wrong = findings.value.filter(one => one.severity !== "ok");
  if (list === null || list.some(one => one.usable && !isDemo(one)) || wrong.length === 0) return null;
  return (
    <section class="connect-doctor">
      <h3>{strings.doctor}</h3>
      <Findings list={wrong} />
    </section>
  );
}
