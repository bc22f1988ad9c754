/** The wall of horns: every servo in 3D with name and angle; a grid of dials without 3D. */

import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { nameOf, servo } from "../bench/fleet";
import { age, angle } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { up } from "../bench/link";
import { pathOf } from "../bench/route";
import { conditionHere, limitsOf } from "../bench/servo-condition";
import { subscribeTelemetry } from "../bench/telemetry-subscription";
import "./view3d.css";
import { Dial } from "../kit/dial";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Scene, type SceneState } from "./scene";
import { ViewTools } from "./tools";
import { boxOf, fill, type PictureBox, type Size } from "./wall-projection";
import { sceneWords as words } from "./words";

/** A place narrower than this has no space for the angle. */
const NARROW_PX = 84;
/** Requested rate for servos whose angle is not streamed. */
const RATE_HZ = 5;

/** The servos in this order, from the back left. Each is a link to its parameters. */
export function WallOfHorns({ uids }: { uids: readonly string[] }) {
  const place = useRef<HTMLElement>(null);
  const state = useSignal<SceneState>("loading");
  const size = useSignal<Size | null>(null);
  useEffect(() => {
    const watcher = new ResizeObserver(entries => {
      const box = entries.at(-1)?.contentRect;
      if (box && box.width > 0 && box.height > 0) size.value = { width: box.width, height: box.height };
    });
    if (place.current) watcher.observe(place.current);
    return () => watcher.disconnect();
  }, []);
  const flat = state.value === "none";
  const fit = size.value && !flat ? fill(uids.length, size.value) : null;
  return (
    <section
      ref={place}
      class="view wall"
      data-testid="wall"
      data-state={state.value}
      data-flat={flat}
      data-frozen={!up.value}
      aria-label={words.wall(uids.length)}
    >
      {fit && uids.length > 0 && (
        <Scene
          still
          title={words.frame}
          state={state}
          uid={null}
          wall={{ columns: fit.columns, scale: Number(fit.scale.toFixed(4)), uids }}
        />
      )}
      <ul class="wall-places">
        {uids.map((uid, index) => (
          <Place
            key={uid}
            uid={uid}
            box={fit && size.value ? boxOf(index, fit, size.value) : null}
            dial={flat}
          />
        ))}
      </ul>
      {uids.length === 0 && <p class="instead second">{words.wallEmpty}</p>}
      {!up.value && (
        <div class="frozen">
          <span class="chip">{words.wallLost}</span>
        </div>
      )}
      {state.value === "loading" && uids.length > 0 && <span class="chip top left">{words.loading}</span>}
      {flat && <span class="chip bottom right">{words.none}</span>}
      {state.value === "shown" && <ViewTools />}
    </section>
  );
}

function Place({ uid, box, dial }: { uid: string; box: PictureBox | null; dial: boolean }) {
  const one = servo(uid);
  const subscribed = useSignal(false);
  useEffect(
    () =>
      subscribed.value ? subscribeTelemetry(uid, ["current_angle"], RATE_HZ, () => undefined) : undefined,
    [uid, subscribed.value],
  );
  const present = angleNow(one);
  const old = one?.online === true && present.stale;
  // The Status of such a servo is not understood: the server reads its angle, at a low rate.
  const unsure = one?.position_unit.state === "conflict";
  useEffect(() => {
    if (old && unsure) subscribed.value = true;
  }, [old, unsure]);
  if (!one) return null;
  const { stale } = present;
  const condition = conditionHere(one);
  const path = pathOf("overview", uid);
  const said = angle(present.value);
  return (
    <li
      style={
        box
          ? {
              left: `${box.left}px`,
              top: `${box.top}px`,
              width: `${box.width}px`,
              height: `${box.height}px`,
            }
          : {}
      }
    >
      <a
        class="wall-place"
        href={path}
        data-testid={`wall-${uid}`}
        data-stale={stale}
        title={`${condition.headline}. ${condition.line}`}
        aria-label={words.wallOpen(nameOf(one), said, condition.headline)}
        onClick={event => follow(event, path)}
      >
        {dial && (
          <Dial
            size={120}
            angle={present.value}
            command={one.command_deg}
            limits={limitsOf(uid)}
            stale={stale}
          />
        )}
        <span class="wall-name">
          <Glyph kind={condition.kind} size={13} />
          <b>{nameOf(one)}</b>
        </span>
        {(dial || (box !== null && box.width >= NARROW_PX)) && (
          <span class="wall-angle">
            {stale && present.age !== null && present.value !== null
              ? words.wallOld(said, age(present.age))
              : said}
          </span>
        )}
      </a>
    </li>
  );
}
