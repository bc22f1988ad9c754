/** Owns the Motion page of one servo: off until it is asked for, each visit anew; then jog and plot. */
import { useEffect } from "preact/hooks";
import { loaded, nameOf, servo } from "../state/fleet";
import { connection } from "../state/link";
import { endMotion, motion } from "../state/motion";
import { sheetOf } from "../state/parameters";
import { go, pathOf } from "../state/route";
import { narrow } from "../state/screen";
import { text } from "../text/en";
import { Button } from "../ui/button";
import { JogPad } from "./jog-pad";
import { MotionGate } from "./motion-gate";
import { ServoHead } from "./servo-head";
import { SidePanel } from "./side-panel";

export function MotionPage({ uid }: { uid: string }) {
  const one = servo(uid);
  const sheet = sheetOf(uid);
  const round = connection.value;
  const ready = one?.online === true && one.state !== "identifying" && one.state !== "restarting";
  // Read anew after each connection, restart and identification.
  useEffect(() => {
    if (round > 0) void sheet.load();
  }, [uid, round, ready]);
  useEffect(() => {
    if (motion.peek().phase === "off") motion.value = { phase: "off", why: null };
    return () => endMotion(null);
  }, [uid]);
  if (!one) {
    return (
      <div class="page">
        <p class="notice-line">
          {loaded.value ? text.params.unknownServo : text.empty.loading}{" "}
          {loaded.value && <Button onClick={() => go(pathOf("servos", null))}>{text.params.toServos}</Button>}
        </p>
      </div>
    );
  }
  const present = motion.value;
  const on = present.phase === "on" && present.uid === uid;
  return (
    <div class="page">
      {on && <MotionBand name={nameOf(one)} />}
      <ServoHead one={one} page="motion" />
      <div class="split motion-split">
        <div class="scroll motion-main">
          {on ? <JogPad uid={uid} torque={present.torque} /> : <MotionGate one={one} />}
        </div>
        {!narrow.value && <SidePanel uid={uid} />}
      </div>
    </div>
  );
}

function MotionBand({ name }: { name: string }) {
  return (
    <section class="motion-band" data-testid="motion-band">
      <span class="k-intent">●</span>
      <b>{text.motion.band(name)}</b>
      <span class="second touch-hide">{text.motion.bandText}</span>
      <span class="grow" />
      <Button testid="disable-motion" onClick={() => endMotion(null)}>
        {text.motion.turnOff}
      </Button>
    </section>
  );
}
