/** The Motion page of one servo: off on every visit until enabled; then jog pad and plot. */
import { useEffect } from "preact/hooks";
import type { TorqueMode } from "../api/types";
import { all, servo } from "../bench/fleet";
import { endMotion, motion } from "../bench/motion";
import { forgetConfirmed } from "../bench/release";
import { narrow } from "../bench/screen";
import { lazy } from "../kit/lazy";
import { MotionGate } from "../servo/motion-gate";
import { SidePanel } from "../servo/side-panel";
import { useSheet } from "../servo/use-sheet";

const JogPad = lazy<{ uid: string; torque: TorqueMode }>(() => import("./jog-pad").then(file => file.JogPad));
const GroupChoice = lazy<{ uid: string }>(() => import("./group-panel").then(file => file.GroupChoice));

export function MotionPage({ uid }: { uid: string }) {
  const one = servo(uid);
  useSheet(uid);
  useEffect(() => {
    forgetConfirmed();
    if (motion.peek().phase === "off") motion.value = { phase: "off", why: null };
    return () => endMotion(null);
  }, [uid]);
  if (!one) return null;
  const present = motion.value;
  const on = present.phase === "on" && present.uid === uid;
  const others = all.value.some(other => other.uid !== uid && other.online);
  return (
    <div class="split motion-split">
      <div class="scroll motion-main">
        {on ? (
          <JogPad uid={uid} torque={present.torque} />
        ) : (
          <MotionGate one={one}>
            {others && (
              <div class="gate-group">
                <GroupChoice uid={uid} />
              </div>
            )}
          </MotionGate>
        )}
      </div>
      {!narrow.value && <SidePanel uid={uid} />}
    </div>
  );
}
