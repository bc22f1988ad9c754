/** The 3D view of a recording: its servos at the present moment, marked as not live. */
import { useSignal } from "@preact/signals";
import { angle } from "../bench/format";
import { up } from "../bench/link";
import { Dial } from "../kit/dial";
import { Icon } from "../kit/icon";
import type { Scrub } from "../plots/scrub";
import { showsAll } from "./others";
import { Scene, type SceneState } from "./scene";
import { ViewTools } from "./tools";
import { sceneWords as words } from "./words";
import "./view3d.css";

/** A view of its own for pages that show no servo. */
export function ReplayView({ scrub }: { scrub: Scrub }) {
  const state = useSignal<SceneState>("loading");
  const resets = useSignal(0);
  const shown = state.value === "shown";
  return (
    <section
      class="view replay"
      data-testid="view-replay"
      data-state={state.value}
      data-frozen={!up.value}
      data-replay="true"
      aria-label={words.replay.frame}
    >
      <Scene
        title={words.replay.frame}
        state={state}
        uid={scrub.front.value}
        poses={scrub.poses.value}
        resets={resets.value}
        onPick={picked => {
          scrub.front.value = picked;
        }}
        alone={!showsAll.value}
      />
      <Replayed scrub={scrub} shown={shown} />
      {state.value === "none" && <span class="chip bottom right">{words.none}</span>}
      {state.value === "loading" && <span class="chip bottom right">{words.loading}</span>}
      {shown && (
        <ViewTools
          others={scrub.poses.value.length > 1}
          onReset={() => {
            resets.value += 1;
          }}
        />
      )}
    </section>
  );
}

/** Overlays of the picture of a recording: that it is one, the servo's name, and missing data. */
export function Replayed({ scrub, shown }: { scrub: Scrub; shown: boolean }) {
  const track = scrub.track;
  const pose = scrub.poses.value.find(one => one.uid === track?.uid);
  if (!track || !pose) return null;
  const known = pose.angle !== null;
  const limits =
    pose.limit_cw !== null && pose.limit_ccw !== null ? { cw: pose.limit_cw, ccw: pose.limit_ccw } : null;
  const figures = !known
    ? words.replay.noValue
    : pose.command === null
      ? angle(pose.angle)
      : words.replay.angles(angle(pose.angle), angle(pose.command));
  return (
    <>
      {!shown && (
        <div class="instead">
          <Dial
            size={200}
            angle={pose.angle}
            command={pose.command}
            limits={limits}
            stale={pose.stale}
            label={words.replay.frame}
          />
        </div>
      )}
      <p class="replay-band" data-testid="replay-band">
        <Icon name="records" size={15} /> {words.replay.band}
      </p>
      {!up.value && (
        <div class="frozen">
          <span class="chip">{words.wallLost}</span>
        </div>
      )}
      {track.name !== "" && <span class="chip top left">{track.name}</span>}
      <span class="replay-chips">
        {track.series === "" && (
          <span class="chip" data-testid="replay-model">
            {words.replay.noModel}
          </span>
        )}
        {known && pose.stale && <span class="chip">{words.replay.old}</span>}
        <span class="chip" data-testid="replay-angle" data-stale={pose.stale}>
          {figures}
        </span>
      </span>
    </>
  );
}
