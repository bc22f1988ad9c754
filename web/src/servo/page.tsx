/** Common to all pages of a servo: head, tabs, motion band, and keys and buttons for the next servo. */

import type { ComponentChildren } from "preact";
import { type KnownServo, nameOf, peekServo, uids } from "../bench/fleet";
import { endMotion, membersOf, motion } from "../bench/motion";
import { go, OF_A_SERVO, pathOf, route, type ServoTab, sameFor } from "../bench/route";
import { rowLabelOf } from "../bench/row-text";
import { Button } from "../kit/button";
import { follow } from "../kit/follow";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Note } from "../kit/note";
import { Panel } from "../kit/panel";
import { useKeys } from "../kit/use-keys";
import { text } from "../text";
import { ServoHead } from "./head";
import { servoWords } from "./words";
import "./page.css";

/** The servo at this offset in the list; undefined beyond its ends. */
function beside(uid: string, by: number): string | undefined {
  return uids.value[uids.value.indexOf(uid) + by];
}

function turn(by: number): void {
  const uid = route.peek().uid;
  const next = uid === null ? undefined : beside(uid, by);
  if (next !== undefined) go(sameFor(next));
}

export function ServoPage({
  one,
  tab,
  children,
}: {
  one: KnownServo;
  tab: ServoTab;
  children: ComponentChildren;
}) {
  const back = () => turn(-1);
  const on = () => turn(1);
  useKeys({ j: on, k: back, ArrowRight: on, ArrowLeft: back });
  const present = motion.value;
  const moves = present.phase === "on" && present.uid === one.uid;
  return (
    <div class="page servo-page">
      {moves && <MotionBand names={membersOf(present).map(each => nameOf(peekServo(each)))} />}
      {(one.owed ?? []).length > 0 && (
        <Note kind="warning" band testid="owed">
          {servoWords.head.owed(nameOf(one), (one.owed ?? []).map(rowLabelOf).join(text.comma))}
        </Note>
      )}
      <Panel>
        <ServoHead one={one}>
          <Turn uid={one.uid} />
        </ServoHead>
      </Panel>
      <nav class="servo-tabs" aria-label={servoWords.head.tabs}>
        {OF_A_SERVO.map(key => (
          <TabLink key={key} one={one} tab={key} chosen={key === tab} />
        ))}
      </nav>
      <div class="servo-tab">
        <Panel key={`${tab}/${one.uid}`}>{children}</Panel>
      </div>
    </div>
  );
}

function TabLink({ one, tab, chosen }: { one: KnownServo; tab: ServoTab; chosen: boolean }) {
  const path = pathOf(tab, one.uid);
  const unseen = one.unacknowledged ?? 0;
  return (
    <a
      href={path}
      data-testid={`servo-tab-${tab}`}
      aria-current={chosen ? "page" : undefined}
      onClick={event => follow(event, path)}
    >
      {text.nav[tab]}
      {tab === "parameters" && one.unsaved.length > 0 && (
        <span class="small">
          <span class="k-intent">
            <Icon name="half" size={13} />
          </span>{" "}
          {one.unsaved.length}
          <span class="hidden-text">{text.servos.ramOnly(one.unsaved.length)}</span>
        </span>
      )}
      {tab === "faults" && unseen > 0 && (
        <span class="small">
          <Glyph kind={one.faults.failure ? "failure" : "warning"} size={12} /> {unseen}
          <span class="hidden-text">{text.nav.unseen}</span>
        </span>
      )}
    </a>
  );
}

/** Previous and next servo in the list. */
function Turn({ uid }: { uid: string }) {
  const known = uids.value;
  if (known.length < 2) return null;
  return (
    <div class="neighbours">
      <Button
        testid="servo-before"
        label={servoWords.head.before}
        disabled={beside(uid, -1) === undefined}
        title="k"
        onClick={() => turn(-1)}
      >
        <Icon name="left" />
      </Button>
      <span class="second" data-testid="servo-place">
        {servoWords.head.place(known.indexOf(uid) + 1, known.length)}
      </span>
      <Button
        testid="servo-after"
        label={servoWords.head.after}
        disabled={beside(uid, 1) === undefined}
        title="j"
        onClick={() => turn(1)}
      >
        <Icon name="right" />
      </Button>
    </div>
  );
}

function MotionBand({ names }: { names: string[] }) {
  return (
    <section class="motion-band" data-testid="motion-band">
      <span class="k-intent">●</span>
      <b>{names.length === 1 ? text.motion.band(names[0] ?? "") : text.motion.bandAll(names.join(", "))}</b>
      <span class="second touch-hide">{text.motion.bandText}</span>
      <span class="grow" />
      <Button testid="disable-motion" onClick={() => endMotion(null)}>
        {text.motion.turnOff}
      </Button>
    </section>
  );
}
