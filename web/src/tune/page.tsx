/** The Tune page of one servo: motion off until enabled, the step test, its runs, and the gains. */
import { useEffect } from "preact/hooks";
import { loaded, servo, uids } from "../bench/fleet";
import { connection } from "../bench/link";
import { endMotion, motion } from "../bench/motion";
import { go, lastUid, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Panel } from "../kit/panel";
import { MotionGate } from "../servo/motion-gate";
import { useSheet } from "../servo/use-sheet";
import { text } from "../text";
import { TuneForm } from "./form";
import { TuneGains } from "./gains";
import { TuneRuns } from "./runs";
import { showServo, testing } from "./state";
import { tune as words } from "./words";
import "../kit/table.css";
import "./tune.css";

export function TunePage({ uid }: { uid: string | null }) {
  const known = uids.value;
  const wanted = uid ?? (lastUid.value !== null && known.includes(lastUid.value) ? lastUid.value : known[0]);
  useEffect(() => {
    if (uid === null && wanted !== undefined) go(pathOf("tune", wanted), true);
  }, [uid, wanted]);
  if (wanted === undefined) {
    return (
      <div class="page">
        <div class="w-empty">
          <p class="strong">{loaded.value ? words.noServo : text.empty.loading}</p>
          {loaded.value && <p class="second">{words.noServoLine}</p>}
          {loaded.value && <Button onClick={() => go(pathOf("servos", null))}>{words.toServos}</Button>}
        </div>
      </div>
    );
  }
  return uid === null ? null : <Tune key={uid} uid={uid} />;
}

function Tune({ uid }: { uid: string }) {
  const one = servo(uid);
  const sheet = useSheet(uid);
  const round = connection.value;
  useEffect(() => {
    if (round > 0) void showServo(uid);
  }, [uid, round]);
  useEffect(() => {
    if (motion.peek().phase === "off") motion.value = { phase: "off", why: null };
    return () => endMotion(null);
  }, [uid]);
  const present = motion.value;
  const on = present.phase === "on" && present.uid === uid;
  const busy = testing.value;
  // Torque and the rows a test reads may have changed: gains are compared with the present values.
  useEffect(() => {
    if (connection.peek() > 0 && !busy) void sheet.load();
  }, [uid, on, busy]);
  if (!one) return null;
  return (
    <div class="servo-tab tune" data-testid="tune-page" data-motion={on ? "on" : "off"}>
      <div class="tune-split">
        <div class="tune-main">
          {on ? <TuneForm one={one} /> : <MotionGate one={one} />}
          <Panel>
            <TuneRuns uid={uid} />
          </Panel>
        </div>
        <Panel>
          <TuneGains uid={uid} />
        </Panel>
      </div>
    </div>
  );
}
