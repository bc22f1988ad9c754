/** The live panel beside the rows: 3D view, readouts, angle plot. Polled only while visible. */
import { useEffect } from "preact/hooks";
import { servo } from "../bench/fleet";
import { watch } from "../bench/telemetry-subscription";
import { openDrift } from "../change/requests";
import { Glyph } from "../kit/glyph";
import { lazy } from "../kit/lazy";
import { Panel } from "../kit/panel";
import { text } from "../text";
import { ViewFrame } from "../view3d/door";
import { Readouts } from "./readouts";

/** Loaded when first shown: it brings the drawing of axes. */
const AnglePlot = lazy<{ uid: string }>(() => import("../plots/angle-plot").then(file => file.AnglePlot));

export function SidePanel({ uid }: { uid: string }) {
  useEffect(() => watch(uid), [uid]);
  return (
    <aside class="side">
      <DriftLine uid={uid} />
      <Panel>
        <ViewFrame uid={uid} />
      </Panel>
      <Panel>
        <Readouts uid={uid} />
      </Panel>
      <Panel>
        <AnglePlot uid={uid} />
      </Panel>
    </aside>
  );
}

/** Another tool changed its ROM: shown above the state. */
function DriftLine({ uid }: { uid: string }) {
  const changed = servo(uid)?.drift ?? [];
  if (changed.length === 0) return null;
  return (
    <p class="drift-line" data-testid="drift-line">
      <Glyph kind="warning" />
      <span class="grow">{text.servos.changedRows(changed.length)}</span>
      <button
        type="button"
        class="link"
        onClick={() => {
          openDrift(uid);
        }}
      >
        {text.servos.showChanged}
      </button>
    </p>
  );
}
