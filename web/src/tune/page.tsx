/** The Tune page of one servo: the verdict above its curves, their figures, and the column that acts. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { loaded, servo, uids } from "../bench/fleet";
import { connection } from "../bench/link";
import { endMotion, motion } from "../bench/motion";
import { observing } from "../bench/role";
import { go, lastUid, pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { Panel } from "../kit/panel";
import { useSheet } from "../servo/use-sheet";
import { text } from "../text";
import { TuneColumn } from "./column";
import { closeDialog, dialog } from "./dialogs";
import { FrequencyPanel } from "./frequency-panel";
import { ImproveDialog } from "./improve";
import { MechanicsDialog } from "./mechanics-dialog";
import { Metrics } from "./metrics";
import { ResponseDialog } from "./response-dialog";
import { RunList } from "./runs";
import { SetUpDialog } from "./set-up";
import { overlay, showServo, testing } from "./state";
import { StepDialog } from "./step-dialog";
import { StepPanel } from "./step-panel";
import type { Direction } from "./step-runs";
import { VerdictLine } from "./verdict";
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
  const direction = useSignal<Direction>("there");
  useEffect(() => {
    if (round > 0) void showServo(uid);
  }, [uid, round]);
  useEffect(() => {
    if (motion.peek().phase === "off") motion.value = { phase: "off", why: null };
    return () => {
      closeDialog();
      endMotion(null);
    };
  }, [uid]);
  const present = motion.value;
  const on = present.phase === "on" && present.uid === uid;
  const busy = testing.value;
  // Torque and the rows a test reads may have changed: gains are compared with the present values.
  useEffect(() => {
    if (connection.peek() > 0 && !busy) void sheet.load();
  }, [uid, on, busy]);
  if (!one) return null;
  const runs = overlay.value?.runs ?? [];
  const locked = observing.value || !one.online;
  return (
    <div class="servo-tab tune" data-testid="tune-page" data-motion={on ? "on" : "off"}>
      <div class="tune-split">
        <Panel>
          <VerdictLine uid={uid} locked={locked} />
        </Panel>
        <div class="tune-left">
          <div class="tune-main">
            <div class="tune-panels">
              <Panel>
                <StepPanel runs={runs} direction={direction} locked={locked} />
              </Panel>
              <Panel>
                <FrequencyPanel runs={runs} locked={locked} />
              </Panel>
            </div>
            <Panel>{overlay.value && <Metrics overlay={overlay.value} direction={direction.value} />}</Panel>
          </div>
          <div class="tune-runs">
            <Panel>
              <RunList uid={uid} />
            </Panel>
          </div>
        </div>
        <Panel>
          <TuneColumn one={one} />
        </Panel>
      </div>
      {dialog.value === "step" && <StepDialog one={one} />}
      {dialog.value === "response" && <ResponseDialog one={one} />}
      {dialog.value === "set-up" && <SetUpDialog uid={uid} />}
      {dialog.value === "mechanics" && <MechanicsDialog one={one} />}
      {dialog.value === "improve" && <ImproveDialog one={one} />}
    </div>
  );
}
