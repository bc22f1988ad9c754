/** The confirmation before a bundle is played: what is left for it, and that nothing can be sent. */

import { useSignal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Bus } from "../api/types";
import { bus } from "../bench/bench";
import { channelOf } from "../bench/bus-now";
import { problemText } from "../bench/facts";
import { go, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { recorder as words } from "../text/topics";

const OPENING_MS = 60_000;

export function PlayDialog({ name, onClose }: { name: string; onClose: () => void }) {
  const busy = useSignal(false);
  const why = useSignal<string | null>(null);
  const present = bus.value;
  const play = async () => {
    busy.value = true;
    why.value = null;
    try {
      bus.value = await ask<Bus>("PUT", "/bus", {
        body: { address: `bundle:${name}` },
        timeout_ms: OPENING_MS,
      });
      onClose();
      go(pathOf("servos", null));
    } catch (error) {
      why.value = problemText(problemOf(error));
      busy.value = false;
    }
  };
  return (
    <Dialog
      title={words.playTitle}
      subtitle={words.playText(name)}
      testid="play-dialog"
      onClose={onClose}
      foot={
        <>
          <span data-first-focus>
            <Button onClick={onClose}>{text.cancel}</Button>
          </span>
          <span class="grow" />
          <Button look="primary" live testid="play-confirm" disabled={busy.value} onClick={() => void play()}>
            {busy.value && <Spinner />}
            {busy.value ? words.playing : words.playConfirm}
          </Button>
        </>
      }
    >
      <div class="rec-play">
        {present?.address && present.state !== "disconnected" && (
          <p>
            <Glyph kind="warning" size={15} /> {words.playNow(channelOf(present.address))}
          </p>
        )}
        <p>{words.playSafe}</p>
        {why.value !== null && (
          <p class="refusal" role="alert">
            <Glyph kind="failure" size={14} /> {why.value}
          </p>
        )}
      </div>
    </Dialog>
  );
}
