/** Improve: goal, bounds, what will move, the set-up, the promise to restore, and the one button. */
import { signal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { ImproveOptions, ImprovePreview } from "../api/lab-types";
import { all, type KnownServo, nameOf } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { sheetOf } from "../bench/parameters";
import { Resource } from "../bench/resource";
import { observing } from "../bench/role";
import { rowLabelOf } from "../bench/row-text";
import { limitsOf } from "../bench/servo-condition";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { Dial } from "../kit/dial";
import { inSet, TextField, Tick } from "../kit/field";
import { Note } from "../kit/note";
import { Segments } from "../kit/segments";
import { GateNotes, gateOf } from "../servo/motion-gate";
import { closeDialog, dialog } from "./dialogs";
import { between } from "./entries";
import { gainsOf } from "./legend";
import { SetUpPart } from "./set-up";
import { planImprove, startImprove, testing, tuning } from "./state";
import { tune as words } from "./words";

type Goal = "calm" | "fast" | "stiff";

const typed = {
  goal: signal<Goal>("calm"),
  from: signal("−15"),
  to: signal("+15"),
  torque: signal("100"),
  speed: signal("300"),
  time: signal("120"),
  expert: signal(false),
};

function bounds(one: KnownServo) {
  const from = between(typed.from.value, "°", -45, 0);
  const to = between(typed.to.value, "°", 0, 45);
  const torque = between(typed.torque.value, "%", 5, 100);
  const speed = between(typed.speed.value, "rpm", 5, 300);
  const time = between(typed.time.value, "s", 10, 600);
  const present = angleNow(one);
  const at = present.stale ? null : present.value;
  const limits = limitsOf(one.uid);
  const round = (value: number) => Math.round(value * 10) / 10;
  const sweep =
    at === null || from === null || to === null
      ? null
      : {
          from: round(Math.max(at + from, limits?.ccw ?? Number.NEGATIVE_INFINITY)),
          to: round(Math.min(at + to, limits?.cw ?? Number.POSITIVE_INFINITY)),
        };
  return { from, to, torque, speed, time, limits, sweep, present };
}

type Bounds = ReturnType<typeof bounds>;

/** What is wrong with the entries, in words; null if nothing is. */
function wrongEntry({ from, to, torque, speed, time, sweep }: Bounds): string | null {
  const strings = words.improve;
  if (from === null || to === null || to - from < 2) return strings.rangeWrong;
  if (torque === null) return strings.torqueWrong;
  if (speed === null) return strings.speedWrong;
  if (time === null) return strings.timeWrong;
  if (sweep && sweep.to - sweep.from < 2) return strings.noRoom;
  return null;
}

export function ImprovePart({ one }: { one: KnownServo }) {
  const strings = words.improve;
  const found = bounds(one);
  const wrong = wrongEntry(found);
  const { from, to, torque, speed, time } = found;
  const held = heldGains(one.uid);
  return (
    <>
      <section class="tune-part tune-goal" aria-label={strings.goal}>
        <Segments<Goal>
          label={strings.goal}
          chosen={typed.goal.value}
          onChoose={key => {
            typed.goal.value = key;
          }}
          options={(["calm", "fast", "stiff"] as const).map(key => ({ key, label: strings.goals[key] }))}
        />
        <p class="second small">{strings.means[typed.goal.value]}</p>
        <div class="tune-bounds">
          <Range wrong={from === null || to === null} />
          <TextField
            label={strings.torque}
            unit="%"
            number
            at={typed.torque}
            error={torque === null}
            testid="improve-torque"
          />
          <TextField
            label={strings.speed}
            unit="rpm"
            number
            at={typed.speed}
            error={speed === null}
            testid="improve-speed"
          />
          <TextField
            label={strings.time}
            unit="s"
            number
            at={typed.time}
            error={time === null}
            testid="improve-time"
          />
        </div>
        <Note kind="warning" testid="improve-against">
          {wrong}
        </Note>
      </section>
      <section class="tune-part tune-moves" aria-label={strings.whatMoves}>
        <Moves found={found} size={76} />
      </section>
      <SetUpPart />
      <section class="tune-part tune-act">
        <p class="second small">{strings.promise(held)}</p>
        <PackageMissing />
        <Button
          look="primary"
          live
          testid="improve-open"
          // Not for an unknown angle, which the dialog awaits: a press while a reading is late would be lost.
          disabled={wrong !== null || testing.value || tuning.value?.available === false || observing.value}
          onClick={() => {
            dialog.value = "improve";
          }}
        >
          {strings.open}
        </Button>
      </section>
    </>
  );
}

/** Names the package that the server lacks. */
function PackageMissing() {
  const able = tuning.value;
  if (!able?.install) return null;
  return (
    <Note kind="notice" testid="package-missing">
      {words.improve.packageMissing(able.package)} <code>{able.install}</code>
    </Note>
  );
}

/** Two numbers in one field: how far to either side of the present angle. */
function Range({ wrong }: { wrong: boolean }) {
  const strings = words.improve;
  const input = (at: { value: string }, label: string, testid: string) => (
    <input
      type="text"
      inputMode="decimal"
      autocomplete="off"
      spellcheck={false}
      aria-label={label}
      aria-invalid={wrong}
      data-testid={testid}
      value={at.value}
      onFocus={event => event.currentTarget.select()}
      onInput={event => {
        at.value = event.currentTarget.value;
      }}
    />
  );
  return (
    <div class="entry">
      <span class="tune-label">{strings.range}</span>
      <span class="box" data-wrong={wrong}>
        {input(typed.from, strings.rangeFrom, "improve-from")}
        <span class="second">{strings.rangeTo}</span>
        {input(typed.to, strings.rangeUpTo, "improve-to")}
        <span class="unit">°</span>
      </span>
    </div>
  );
}

function Moves({ found, size }: { found: Bounds; size: number }) {
  const strings = words.improve;
  const { sweep, present, limits, torque, speed } = found;
  return (
    <>
      <Dial
        size={size}
        angle={present.value}
        limits={limits}
        stale={present.stale}
        {...(sweep && sweep.to > sweep.from ? { sweep } : {})}
      />
      {sweep && torque !== null && speed !== null && (
        <p data-testid="improve-moves">
          <b>{strings.moves(angle(sweep.from), angle(sweep.to))}</b>
          {strings.most(withUnit(number(speed, 0), "rpm"), withUnit(number(torque, 0), "%"))}
        </p>
      )}
    </>
  );
}

function heldGains(uid: string): string {
  const sheet = sheetOf(uid);
  const of = (key: string) => sheet.held(key) ?? null;
  return gainsOf({ parameters: { angle_p_gain: of("angle_p_gain"), angle_d_gain: of("angle_d_gain") } });
}

/** Other servos to improve in the same way. */
const chosen = signal<ReadonlySet<string>>(new Set());

export function ImproveDialog({ one }: { one: KnownServo }) {
  const strings = words.improve;
  const present = bounds(one);
  // About the angle at which it opened: that of a servo that hunts differs with every reading.
  const first = useRef<Bounds["sweep"]>(null);
  first.current ??= present.sweep;
  const found = { ...present, sweep: first.current };
  const why = wrongEntry(found) ?? (found.sweep === null ? words.step.unknownAngle : null);
  const { on, able } = gateOf(one);
  const { from, to, sweep, torque, speed, time } = found;
  const goal = typed.goal.value;
  const alike = all.value.filter(each => each.uid !== one.uid && each.model === one.model && each.online);
  const others = alike.map(each => each.uid).filter(uid => chosen.value.has(uid));
  const body: ImproveOptions | null =
    sweep === null || torque === null || speed === null || time === null || from === null || to === null
      ? null
      : {
          goal,
          bounds: {
            // Each of several servos moves about its own angle, as far as the server's default.
            from_deg: others.length > 0 ? null : sweep.from,
            to_deg: others.length > 0 ? null : sweep.to,
            torque_pct: torque,
            speed_rpm: speed,
            time_s: time,
          },
          expert: typed.expert.value,
        };
  const plan = useMemo(() => new Resource(() => Promise.resolve<ImprovePreview | null>(null)), []);
  const asked = JSON.stringify(body);
  useEffect(() => {
    if (body !== null && why === null) void plan.load(() => planImprove(one.uid, body));
  }, [asked, why]);
  const planned = plan.value.value;
  return (
    <Confirm
      title={strings.dialogTitle(nameOf(one), strings.goals[goal])}
      subtitle={strings.means[goal]}
      verb={on ? strings.go : strings.enableAndGo}
      doing={words.step.starting}
      danger
      // Not before the plan is shown, which moves the button.
      ready={why === null && planned !== null && (on || able) && !testing.value}
      testid="improve-dialog"
      actId="improve-go"
      act={() => (body ? startImprove(one.uid, body, others) : undefined)}
      onClose={closeDialog}
    >
      <div class="what-moves">
        <Moves found={found} size={112} />
      </div>
      <p data-testid="improve-plan">
        {strings.takes(withUnit(number(time ?? 0, 0), "s"))}{" "}
        {planned &&
          strings.plan(
            planned.steps,
            withUnit(number(Math.abs(planned.step_deg), 1), "°"),
            planned.changes.map(rowLabelOf).join(words.list),
          )}
      </p>
      <p class="second">{strings.promise(heldGains(one.uid))}</p>
      {alike.length > 0 && (
        <details class="tune-alike" data-testid="improve-alike">
          <summary>{strings.alike(others.length)}</summary>
          <p class="second small">{strings.alikeLead}</p>
          {alike.map(each => (
            <Tick
              key={each.uid}
              label={nameOf(each)}
              at={inSet(chosen, each.uid)}
              testid={`alike-${each.uid}`}
            />
          ))}
        </details>
      )}
      <Tick label={strings.expert} at={typed.expert} testid="improve-expert" />
      <p class="second small">{strings.stops}</p>
      <Note kind="warning">{why ?? plan.problem.value}</Note>
      <GateNotes one={one} />
    </Confirm>
  );
}
