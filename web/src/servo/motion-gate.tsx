/** The Motion page before motion is on: what will happen, what prevents it, and the button. */

import { signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { stopped } from "../bench/bench";
import { now } from "../bench/clock";
import { type KnownServo, nameOf, peekServo } from "../bench/fleet";
import { angle } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { readOnly } from "../bench/model";
import { enableMotion, leaseOfOther, motion, motionRefusal } from "../bench/motion";
import { those } from "../bench/release";
import { commanderOf, observing } from "../bench/role";
import { limitsOf } from "../bench/servo-condition";
import { stopInSight } from "../bench/stop-sight";
import { wiggling } from "../bench/wiggle";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { lazy } from "../kit/lazy";
import { Note } from "../kit/note";
import { text } from "../text";
import { JogDial } from "./command-dial";

const TakeOver = lazy<{ uid: string }>(() => import("./take-over").then(file => file.TakeOver));

interface Props {
  one: KnownServo;
  /** Content between the text and the button: the other servos of the group. */
  children?: ComponentChildren;
}

/** Set by the group chooser: turns motion on for the whole group. Null for one servo. */
export const enableAll = signal<{ label: string; act: () => void } | null>(null);

interface Gate {
  /** Motion is on for this servo. */
  on: boolean;
  requesting: boolean;
  /** What prevents motion, in words. */
  against: string | null;
  /** Another client has motion control of this servo. */
  others: boolean;
  /** Whether it can be enabled now. */
  able: boolean;
}

/** Whether motion of a servo can be enabled. */
export function gateOf(one: KnownServo): Gate {
  const present = motion.value;
  const requesting = present.phase === "requesting";
  const against = hindrance(one);
  const others = present.phase === "waiting" || (heldByOther(one.uid) > 0 && !wiggling.value);
  return {
    on: present.phase === "on" && present.uid === one.uid,
    requesting,
    against,
    others,
    able: !requesting && !wiggling.value && against === null && (!others || present.phase === "held"),
  };
}

/** What prevents motion, in a dialog that would enable it: nothing if nothing does. */
export function GateNotes({ one }: { one: KnownServo }) {
  const { on, against, others } = gateOf(one);
  if (on) return null;
  return (
    <>
      {(motion.value.phase === "held" || (others && !stopped.value)) && <TakeOver uid={one.uid} />}
      <Note kind="warning" testid="motion-hindrance">
        {against}
      </Note>
    </>
  );
}

export function MotionGate({ one, children }: Props) {
  const present = motion.value;
  const name = nameOf(one);
  const group = children ? enableAll.value : null;
  const { requesting, against, others, able } = gateOf(one);
  const why = against ? null : (motionRefusal.value ?? (present.phase === "off" ? present.why : null));
  const { value: at, stale } = angleNow(one);
  const off = those("off")
    .map(each => nameOf(peekServo(each)))
    .join(", ");
  const limits = limitsOf(one.uid);
  const outside = at !== null && limits !== null && (at > limits.cw + 0.05 || at < limits.ccw - 0.05);
  return (
    <section class="gate">
      <JogDial angle={at} command={null} limits={limits} stale={stale} />
      <div class="gate-text">
        <h2>{text.motion.off(name)}</h2>
        {(present.phase === "held" || (others && !stopped.value)) && <TakeOver uid={one.uid} />}
        <p>{text.motion.what}</p>
        {outside && <p>{text.motion.outside(angle(at))}</p>}
        <p class="second">{text.motion.ends}</p>
        <p class="second">{text.motion.clear}</p>
        {why !== null && (
          <p class="refusal" role="alert" data-testid="motion-refusal">
            <Glyph kind="failure" size={14} /> {why}
          </p>
        )}
        {present.phase === "off" && off !== "" && (
          <p class="second" role="status" data-testid="torque-is-off">
            {text.motion.torqueOff(off)}
          </p>
        )}
        {against !== null && (
          <p class="refusal" data-testid="motion-hindrance">
            <Glyph kind="warning" size={15} /> {against}
          </p>
        )}
        {against === null && !others && children}
        <Button
          look="primary"
          testid="enable-motion"
          live
          disabled={!able}
          onClick={() => (group ? group.act() : void enableMotion(one.uid))}
        >
          {requesting && <Spinner />}
          {requesting ? text.motion.requesting : (group?.label ?? text.motion.enable(name))}
        </Button>
      </div>
    </section>
  );
}

/** Seconds that another client's motion control of this servo lasts. */
function heldByOther(uid: string): number {
  const held = leaseOfOther(uid);
  return held ? held.endsAt - now.value : 0;
}

/** What prevents motion, known before a request. */
function hindrance(one: KnownServo): string | null {
  if (observing.value) return text.motion.whileObserving;
  if (stopped.value) return text.motion.whileStopped;
  if (!stopInSight.value) return text.motion.stopHidden;
  const name = nameOf(one);
  const by = commanderOf(one);
  if (by) return text.motion.whileCommanded(name, by.node_id);
  if (readOnly(one)) return text.motion.whileUnknown(name);
  switch (one.state) {
    case "ready":
    case "soft_start":
      return one.online ? null : text.motion.whileOffline(name);
    case "offline":
      return text.motion.whileOffline(name);
    case "protected":
      return text.motion.whileProtected(name);
    default:
      return text.motion.whileBusy(name);
  }
}
