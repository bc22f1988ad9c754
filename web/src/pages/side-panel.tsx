/** Owns the live panel beside the rows: 3D view, readouts, angle plot; polled only while looked at. */
import { useEffect } from "preact/hooks";
import { openDrift } from "../state/drift";
import { servo } from "../state/fleet";
import { watch } from "../state/watch";
import { text } from "../text/en";
import { AnglePlot } from "../ui/angle-plot";
import { Glyph } from "../ui/glyph";
import { Readouts } from "./readouts";
import { ViewFrame } from "./view-frame";

export function SidePanel({ uid }: { uid: string }) {
  useEffect(() => watch(uid), [uid]);
  return (
    <aside class="side">
      <DriftLine uid={uid} />
      <ViewFrame uid={uid} />
      <Readouts uid={uid} />
      <AnglePlot uid={uid} />
    </aside>
  );
}

/** Somebody else wrote to its ROM: said above everything that shows how it is. */
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
          openDrift.value = uid;
        }}
      >
        {text.servos.showChanged}
      </button>
    </p>
  );
}
