/** Group motion on the Motion page: selection of servos, and their dials while they move. */

import { useEffect } from "preact/hooks";
import { all, nameOf, servo } from "../bench/fleet";
import { age, angle, number } from "../bench/format";
import { angleNow } from "../bench/fresh";
import { membersOf, motion, movingTogether, setpoint } from "../bench/motion";
import { readSheet } from "../bench/parameters";
import { limitsOf } from "../bench/servo-condition";
import { Button } from "../kit/button";
import { Dial } from "../kit/dial";
import { cell, Tick } from "../kit/field";
import { Note } from "../kit/note";
import { Segments } from "../kit/segments";
import { enableAll } from "../servo/motion-gate";
import {
  against,
  chosenCompanions,
  enableGroup,
  type GroupMode,
  groupMode,
  offsets,
  restartGroup,
  setGroupMode,
  stream,
} from "./group";
import { sweep } from "./sweep";
import { jogging as words } from "./words";
import "./jog.css";

/** Before motion: a check box for each other servo that can be commanded together with this one. */
export function GroupChoice({ uid }: { uid: string }) {
  const first = servo(uid);
  const others = all.value.filter(one => one.uid !== uid && one.online);
  const why = first ? against(first) : null;
  const able = why === null ? others.filter(one => against(one) === null) : [];
  const ticked = able.map(one => one.uid).filter(each => chosenCompanions.value.includes(each));
  const key = ticked.join();
  useEffect(() => {
    for (const each of ticked) readSheet(each);
    const act = () => void enableGroup(uid, ticked);
    enableAll.value = ticked.length === 0 ? null : { label: words.enable(ticked.length + 1), act };
    return () => {
      enableAll.value = null;
    };
  }, [uid, key]);
  if (others.length === 0) return null;
  const tick = (each: string) => {
    const before = chosenCompanions.value;
    chosenCompanions.value = before.includes(each) ? before.filter(one => one !== each) : [...before, each];
  };
  return (
    <details class="group-choice" data-testid="group" open={ticked.length > 0}>
      <summary>{words.group}</summary>
      {why !== null && <p class="small second">{words.groupUnavailable(why)}</p>}
      <ul>
        {others.map(one => {
          const hindered = why ?? against(one);
          return (
            <li key={one.uid}>
              <Tick
                label={nameOf(one)}
                at={cell(ticked.includes(one.uid), () => tick(one.uid))}
                disabled={hindered !== null}
                testid={`group-${one.uid}`}
              />
              {why === null && hindered !== null && <span class="small second">{hindered}</span>}
            </li>
          );
        })}
      </ul>
    </details>
  );
}

/** While motion is on: the group mode, and a dial for each of the other servos. */
export function Members() {
  const present = motion.value;
  const members = membersOf(present);
  const group = movingTogether.value;
  if (members.length < 2 || group === null || present.phase !== "on") return null;
  const state = stream.value;
  const ended = state?.ended ?? null;
  return (
    <section class="members" aria-label={words.members} data-testid="members">
      <div class="members-how">
        <Segments<GroupMode>
          label={words.groupMode}
          chosen={groupMode.value}
          onChoose={next => {
            if (sweep.peek() === null) setGroupMode(next, members);
          }}
          options={[
            { key: "same", label: words.same },
            { key: "apart", label: words.apart },
          ]}
        />
        <p class="small second">
          {groupMode.value === "same" ? words.sameHint : words.apartHint}{" "}
          {state !== null && ended === null && (
            <span data-testid="group-beat">
              {words.streamRate(number(state.rate_hz, 0), String(state.misses))}
            </span>
          )}
        </p>
      </div>
      <div class="member-dials">
        {members.slice(1).map(uid => (
          <Member key={uid} uid={uid} />
        ))}
      </div>
      {ended !== null && (
        <div class="members-ended">
          <Note testid="group-ended">{words.ended(ended)}</Note>
          <Button testid="group-again" live onClick={() => void restartGroup(group)}>
            {words.again}
          </Button>
        </div>
      )}
    </section>
  );
}

function Member({ uid }: { uid: string }) {
  const one = servo(uid);
  if (!one) return null;
  const at = angleNow(one);
  const { stale } = at;
  const wanted = setpoint.value;
  const goal = wanted === null ? null : wanted + (offsets.value.get(uid) ?? 0);
  return (
    <figure class="member" data-testid={`member-${uid}`} data-stale={stale}>
      <Dial size={72} angle={at.value} command={goal} limits={limitsOf(uid)} stale={stale} />
      <figcaption>
        <b>{nameOf(one)}</b>
        <span class={stale ? "dim" : ""}>{angle(at.value)}</span>
        {stale && at.age !== null && <span class="small strong">{words.silent(age(at.age))}</span>}
      </figcaption>
    </figure>
  );
}
