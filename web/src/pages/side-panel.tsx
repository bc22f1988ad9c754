/** Owns the live panel beside the rows: 3D view, readouts, angle plot; polled only while looked at. */
import { useEffect } from "preact/hooks";
import { watch } from "../state/watch";
import { AnglePlot } from "../ui/angle-plot";
import { Readouts } from "./readouts";
import { ViewFrame } from "./view-frame";

export function SidePanel({ uid }: { uid: string }) {
  useEffect(() => watch(uid), [uid]);
  return (
    <aside class="side">
      <ViewFrame uid={uid} />
      <Readouts uid={uid} />
      <AnglePlot uid={uid} />
    </aside>
  );
}
