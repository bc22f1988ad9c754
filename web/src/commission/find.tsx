/** The first step: new servos, nodes waiting for a node ID, and selection of the servos to commission. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Job } from "../api/types";
import { bus, connected } from "../bench/bench";
import { failureText } from "../bench/facts";
import { all, type KnownServo, nameOf, pending } from "../bench/fleet";
import { clock, NONE } from "../bench/format";
import { resultText } from "../bench/note-text";
import { Button } from "../kit/button";
import { cell, Tick } from "../kit/field";
import { Guides } from "../kit/guide";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { EmptyServos, Reconnect } from "../servo/empty";
import { Waiting } from "../servo/waiting-nodes";
import { text } from "../text";
import { changeDraft, draft } from "./draft";
import { Actions, StepQuestion } from "./parts";
import { candidates, selectServos, show, unfinishedJob } from "./state";
import { commission as words } from "./words";

const strings = words.find;

export function FindStep() {
  const found = candidates.value.value?.servos ?? [];
  const fresh = found.map(one => one.servo.uid);
  const others = all.value.filter(one => one.online && !fresh.includes(one.uid));
  const folded = useSignal(true);
  const touched = useSignal(draft.peek().chosen.length > 0);
  // All new servos, including later ones, are selected until the user changes the selection. A servo may be a candidate
  // before the page knows it; it is selected when both are there.
  const known = new Set(all.value.map(one => one.uid));
  const key = fresh.filter(uid => known.has(uid)).join(" ");
  useEffect(() => {
    const present = draft.peek().chosen;
    const seen = new Set(all.peek().map(one => one.uid));
    if (!touched.peek()) selectServos(fresh);
    else if (present.some(uid => !seen.has(uid))) selectServos(present.filter(uid => seen.has(uid)));
  }, [key]);
  const chosen = draft.value.chosen;
  const set = (uids: readonly string[]) => {
    touched.value = true;
    selectServos(uids);
  };
  const toggle = (uid: string) =>
    set(chosen.includes(uid) ? chosen.filter(one => one !== uid) : [...chosen, uid]);
  const left = unfinishedJob.value;
  const none = found.length === 0;
  return (
    <>
      <StepQuestion title={none ? strings.none : strings.title}>
        <p>{none ? strings.noneLead : strings.lead(found.length)}</p>
        {none && others.length > 0 && <Guides places={["commission"]} />}
      </StepQuestion>
      <Scroll label={strings.table} testid="find-step">
        {left && <Unfinished job={left} />}
        {!connected.value && bus.value && <Reconnect />}
        {candidates.problem.value !== null && <Note band>{words.failed(candidates.problem.value)}</Note>}
        {found.length > 1 && (
          <div class="c-tools">
            <span class="second" data-testid="find-count">
              {strings.chosen(chosen.filter(uid => fresh.includes(uid)).length, found.length)}
            </span>
            <Button
              onClick={() =>
                set(chosen.length === 0 ? fresh : fresh.every(uid => chosen.includes(uid)) ? [] : fresh)
              }
              testid="choose-all"
            >
              {fresh.every(uid => chosen.includes(uid)) ? strings.chooseNone : strings.chooseAll}
            </Button>
          </div>
        )}
        <ul class="c-list" aria-label={strings.table}>
          {found.map(one => (
            <Row
              key={one.servo.uid}
              one={one.servo}
              note={one.servo_id === null ? strings.noId : strings.id("0")}
              on={chosen.includes(one.servo.uid)}
              onToggle={() => toggle(one.servo.uid)}
            />
          ))}
        </ul>
        <Waiting />
        {none && others.length === 0 && connected.value && <EmptyServos loading={false} />}
        {others.length > 0 && (
          <>
            <button
              type="button"
              class="c-fold"
              aria-expanded={!folded.value}
              data-testid="find-others"
              onClick={() => {
                folded.value = !folded.value;
              }}
            >
              {strings.others(others.length)}
            </button>
            {!folded.value && (
              <>
                <p class="second w-line">{strings.othersLead}</p>
                <ul class="c-list" aria-label={strings.others(others.length)}>
                  {others.map(one => (
                    <Row
                      key={one.uid}
                      one={one}
                      note={strings.id(String(one.servo_id ?? NONE))}
                      on={chosen.includes(one.uid)}
                      onToggle={() => toggle(one.uid)}
                    />
                  ))}
                </ul>
              </>
            )}
          </>
        )}
      </Scroll>
      <Actions>
        <span class="second grow">{pending.value.length > 0 && strings.waiting(pending.value.length)}</span>
        <Button
          look="primary"
          live
          testid="find-go"
          disabled={chosen.length === 0}
          onClick={() => changeDraft({ step: "identify" })}
        >
          {strings.go(chosen.length)}
        </Button>
      </Actions>
    </>
  );
}

interface RowProps {
  one: Pick<KnownServo, "uid" | "label" | "serial" | "name" | "model" | "node_id">;
  note: string;
  on: boolean;
  onToggle: () => void;
}

function Row({ one, note, on, onToggle }: RowProps) {
  const name = nameOf(one as KnownServo);
  return (
    <li>
      <Tick
        label={strings.choose(name)}
        at={cell(on, onToggle)}
        class="c-row pick"
        holder={`pick-${one.uid}`}
      >
        <span class="c-who">
          <span class="serial">{name}</span>
          <span class="dim">
            {one.model ?? text.servos.unknownModel}
            {one.label && one.serial ? `, ${one.serial}` : ""}
          </span>
        </span>
        <span class="second">{strings.node(String(one.node_id ?? NONE))}</span>
        <span class="second c-id">{note}</span>
      </Tick>
    </li>
  );
}

function Unfinished({ job }: { job: Job }) {
  const result = resultText(job.result) || (job.error ? failureText(job.error) : "");
  return (
    <Note
      kind="warning"
      band
      testid="unfinished"
      action={
        <Button onClick={() => show(job)} testid="look-unfinished">
          {strings.show}
        </Button>
      }
    >
      {strings.unfinished(clock(job.created_at), result)}
    </Note>
  );
}
