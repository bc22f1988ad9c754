/** The confirmation before playback: what is disconnected, and that nothing can be sent. */

import { callApi } from "../api/client";
import { bus } from "../bench/bench";
import { channelOf } from "../bench/bus-now";
import { go, pathOf } from "../bench/route";
import { Confirm } from "../kit/confirm";
import { Note } from "../kit/note";
import { recorder as words } from "./words";

const OPENING_MS = 60_000;

export function PlayDialog({ name, onClose }: { name: string; onClose: () => void }) {
  const present = bus.value;
  return (
    <Confirm
      title={words.playTitle}
      subtitle={words.playText(name)}
      verb={words.playConfirm}
      doing={words.playing}
      testid="play-dialog"
      actId="play-confirm"
      act={async () => {
        const body = { address: `recording:${name}` };
        bus.value = await callApi("PUT", "/bus", { body, timeout_ms: OPENING_MS });
        go(pathOf("servos", null));
      }}
      onClose={onClose}
    >
      <Note kind="warning">
        {present?.address && present.state !== "disconnected" && words.playNow(channelOf(present.address))}
      </Note>
      <p>{words.playSafe}</p>
    </Confirm>
  );
}
