/** The dialog of a frequency response: excitation, what will move, and the press that moves it. */
import { signal } from "@preact/signals";
import type { FrequencyTestOptions } from "../api/lab-types";
import type { KnownServo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { limitsOf } from "../bench/servo-condition";
import { Choice, TextField, Tick } from "../kit/field";
import { between, mostOf } from "./entries";
import { MeasureDialog } from "./measure-dialog";
import { startResponse } from "./state";
import { tune as words } from "./words";

const typed = {
  excitation: signal("chirp"),
  amplitude: signal("2"),
  from: signal("0.5"),
  to: signal("20"),
  duration: signal("20"),
  ladder: signal(false),
};

/** Amplitudes of a ladder, as multiples: the largest decides how far the horn moves. */
const LADDER = [0.5, 1, 2];

function values() {
  return {
    amplitude: between(typed.amplitude.value, "°", 0.2, typed.ladder.value ? 10 : 20),
    from: between(typed.from.value, "Hz", 0.1, 10),
    to: between(typed.to.value, "Hz", 1, 25),
    duration: between(typed.duration.value, "s", 3, 60),
  };
}

export function ResponseDialog({ one }: { one: KnownServo }) {
  const strings = words.frequency;
  const { amplitude, from, to, duration } = values();
  const present = angleNow(one);
  const at = present.stale ? null : present.value;
  const limits = limitsOf(one.uid);
  const ladder = typed.ladder.value;
  const most = amplitude === null ? 0 : amplitude * (ladder ? Math.max(...LADDER) : 1);
  const sweep = at === null || amplitude === null ? null : { from: at - most, to: at + most };
  const outside = sweep !== null && limits !== null && (sweep.from < limits.ccw || sweep.to > limits.cw);
  const against =
    amplitude === null
      ? strings.amplitudeWrong(typed.ladder.value ? 10 : 20)
      : from === null || to === null || from >= to
        ? strings.rangeWrong
        : duration === null
          ? strings.durationWrong
          : at === null
            ? words.step.unknownAngle
            : outside
              ? strings.outside(angle(limits.ccw), angle(limits.cw))
              : null;
  const body: FrequencyTestOptions | null =
    amplitude === null || from === null || to === null || duration === null
      ? null
      : {
          excitation: typed.excitation.value === "multisine" ? "multisine" : "chirp",
          amplitude_deg: amplitude,
          from_hz: from,
          to_hz: to,
          duration_s: duration,
          ladder,
        };
  const whole = duration === null ? 0 : duration * (ladder ? LADDER.length : 1);
  return (
    <MeasureDialog
      one={one}
      name="response"
      title={strings.dialogTitle}
      verbs={[strings.go, strings.enableAndGo]}
      act={() => (body ? startResponse(one.uid, body) : undefined)}
      against={against}
      sweep={outside ? null : sweep}
      moves={
        sweep && (
          <>
            <b>{strings.moves(angle(sweep.from), angle(sweep.to))}</b>
            {strings.takes(withUnit(number(whole, 0), "s"), mostOf(one.uid))}
          </>
        )
      }
      lines={<p class="second small">{words.step.writes}</p>}
    >
      <div class="tune-fields">
        <Choice
          label={strings.excitation}
          at={typed.excitation}
          testid="response-excitation"
          options={[
            { key: "chirp", label: strings.chirp },
            { key: "multisine", label: strings.multisine },
          ]}
        />
        <TextField
          label={strings.amplitude}
          unit="°"
          number
          at={typed.amplitude}
          error={amplitude === null}
          testid="response-amplitude"
        />
        <TextField
          label={strings.fromHz}
          unit="Hz"
          number
          at={typed.from}
          error={from === null}
          testid="response-from"
        />
        <TextField
          label={strings.toHz}
          unit="Hz"
          number
          at={typed.to}
          error={to === null}
          testid="response-to"
        />
        <TextField
          label={strings.duration}
          unit="s"
          number
          at={typed.duration}
          error={duration === null}
          testid="response-duration"
        />
      </div>
      <Tick label={strings.ladder} at={typed.ladder} testid="response-ladder" />
    </MeasureDialog>
  );
}
