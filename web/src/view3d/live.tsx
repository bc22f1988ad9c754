/** The 3D view of a servo: frame and chips, covered while frozen, replaced by the dial without 3D. While a
 * recording is open beside it and motion is off, it shows the recording and says so. */

import { useSignal } from "@preact/signals";
import { nameOf, servo, uids } from "../bench/fleet";
import { age, angle } from "../bench/format";
import { figureNow } from "../bench/fresh";
import { up } from "../bench/link";
import { motion } from "../bench/motion";
import { go, route, sameFor } from "../bench/route";
import { limitsOf } from "../bench/servo-condition";
import type { Sight } from "../bench/view-link";
import { replayed } from "../plots/scrub";
import { sceneWords } from "./words";
import "./view3d.css";
import { Dial } from "../kit/dial";
import { showsAll } from "./others";
import { Overlay } from "./overlay";
import { Replayed } from "./replay";
import { Scene, type SceneState } from "./scene";
import { ViewTools } from "./tools";

export function ViewLive({ uid }: { uid: string }) {
  const state = useSignal<SceneState>("loading");
  const resets = useSignal(0);
  const sight = useSignal<Sight | null>(null);
  const present = figureNow(uid, "current_angle");
  const frozen = present.stale;
  const shown = state.value === "shown";
  // A user who moves a servo must see that servo, not a recording.
  const replay = motion.value.phase === "off" ? replayed.value : null;
  const pick = (picked: string) => {
    if (replay) replay.front.value = picked;
    else choose(picked);
  };
  return (
    <section
      class="view"
      data-testid="view-frame"
      data-state={state.value}
      data-frozen={replay ? !up.value : frozen}
      data-replay={replay !== null}
      data-selected={uid}
      aria-label={sceneWords.frame}
    >
      <Scene
        title={sceneWords.frame}
        state={state}
        uid={replay ? replay.front.value : uid}
        poses={replay ? replay.poses.value : null}
        resets={resets.value}
        onPick={pick}
        alone={!showsAll.value}
        sight={sight}
      />
      {replay ? <Replayed scrub={replay} shown={shown} /> : <Now {...{ uid, shown, frozen }} />}
      {shown && !replay && <Overlay sight={sight} live={frozen ? null : { uid, angle: present.value }} />}
      {state.value === "none" && <span class="chip bottom right">{sceneWords.none}</span>}
      {state.value === "loading" && <span class="chip bottom right">{sceneWords.loading}</span>}
      {shown && (
        <ViewTools
          others={replay ? replay.poses.value.length > 1 : uids.value.length > 1}
          onReset={() => {
            resets.value += 1;
          }}
        />
      )}
    </section>
  );
}

/** Overlays of the live picture of a servo. */
function Now({ uid, shown, frozen }: { uid: string; shown: boolean; frozen: boolean }) {
  const one = servo(uid);
  const present = figureNow(uid, "current_angle");
  const limits = limitsOf(uid);
  return (
    <>
      {!shown && (
        <div class="instead">
          <Dial
            size={200}
            angle={present.value ?? one?.angle_deg ?? null}
            command={one?.command_deg ?? null}
            limits={limits}
            stale={frozen}
            label={sceneWords.none}
          />
        </div>
      )}
      {frozen && (
        <div class="frozen">
          <span class="chip">
            {present.age === null ? sceneWords.noData : sceneWords.frozen(age(present.age))}
          </span>
        </div>
      )}
      {!shown && <span class="chip top left">{nameOf(one)}</span>}
      {!frozen && present.age !== null && (
        <span class="chip top right">{sceneWords.live(age(present.age))}</span>
      )}
      {limits && (
        <span class={`chip left ${shown ? "top" : "bottom"}`}>
          {sceneWords.limits(angle(limits.ccw), angle(limits.cw))}
        </span>
      )}
    </>
  );
}

/** Show the same page for the servo that was clicked. Not while motion is on, which leaving would end. */
function choose(picked: string): void {
  const here = route.peek();
  if (picked === here.uid || !servo(picked) || motion.peek().phase !== "off") return;
  go(sameFor(picked));
}
