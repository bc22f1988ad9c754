/** The second step: each servo wiggles and is assigned an ID and a name. */

import { useSignal } from "@preact/signals";
import { useEffect, useId, useRef } from "preact/hooks";
import { stopped } from "../bench/bench";
import { type KnownServo, nameOf, servo } from "../bench/fleet";
import { angle } from "../bench/format";
import { up } from "../bench/link";
import { modelName } from "../bench/model";
import { wholeNumber } from "../bench/number";
import { sheetOf } from "../bench/parameters";
import { watch } from "../bench/telemetry-subscription";
import { wiggle, wiggled, wiggling } from "../bench/wiggle";
import { Button } from "../kit/button";
import { cell, TextField } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { Scroll } from "../kit/scroll";
import { LiveDial } from "../servo/live-dial";
import { text } from "../text";
import {
  changeDraft,
  changeEntry,
  count,
  draft,
  type Entry,
  HIGHEST_ID,
  LONGEST_LABEL,
  LOWEST_ID,
  nextOpen,
  wrongIds,
} from "./draft";
import { Actions, StepQuestion } from "./parts";
import { assignRemaining, owners, suggest } from "./state";
import { commission as words } from "./words";

const strings = words.identify;

export function IdentifyStep() {
  const { chosen, entries, at } = draft.value;
  const tally = count(draft.value);
  const go = (uid: string | null) => {
    suggest(uid);
    changeDraft({ at: uid });
  };
  const open = (uid: string) => {
    changeEntry(uid, { state: "open" });
    go(uid);
  };
  const settle = (uid: string, state: "given" | "skipped") => {
    changeEntry(uid, { state });
    go(nextOpen(draft.peek(), uid));
  };
  return (
    <>
      <StepQuestion title={strings.title}>
        <p>{strings.lead(chosen.length)}</p>
        <p class="second">{strings.moves}</p>
      </StepQuestion>
      <Scroll label={strings.title} testid="identify-step">
        <ul class="c-list">
          {chosen.map((uid, place) => {
            const entry = entries[uid];
            if (!entry) return null;
            return uid === at ? (
              <Active
                key={uid}
                uid={uid}
                entry={entry}
                place={strings.place(place + 1, chosen.length)}
                last={tally.open <= 1}
                onGive={() => settle(uid, "given")}
                onSkip={() => settle(uid, "skipped")}
              />
            ) : (
              <Other
                key={uid}
                uid={uid}
                entry={entry}
                onOpen={() => open(uid)}
                onWiggle={() => {
                  go(uid);
                  void wiggle(uid);
                }}
              />
            );
          })}
        </ul>
        {tally.open > 1 && (
          <p class="w-line second">
            {strings.rest(tally.open)}
            <button type="button" class="link" data-testid="give-rest" onClick={assignRemaining}>
              {strings.giveRest}
            </button>
          </p>
        )}
      </Scroll>
      <Actions>
        <Button onClick={() => changeDraft({ step: "find" })}>{words.back}</Button>
        <span class="second grow">
          {strings.tally(tally.given, tally.skipped)} {strings.stored}
        </span>
        <Button
          look="primary"
          testid="identify-go"
          disabled={tally.open > 0 || tally.given === 0}
          onClick={() => changeDraft({ step: "profile" })}
        >
          {tally.open === 0 && tally.given === 0 ? strings.noneIdentified : strings.go(tally.open)}
        </Button>
      </Actions>
    </>
  );
}

function Who({ uid, one }: { uid: string; one: KnownServo | undefined }) {
  return (
    <span class="c-who">
      <span class="serial">{one?.serial ?? one?.name ?? `${uid.slice(0, 8)}…`}</span>
      <span class="dim">{one ? modelName(one) : text.servos.unknownModel}</span>
    </span>
  );
}

function Other(props: { uid: string; entry: Entry; onOpen: () => void; onWiggle: () => void }) {
  const { uid, entry } = props;
  const one = servo(uid);
  const name = nameOf(one);
  const given = entry.state === "given";
  return (
    <li class="c-row" data-testid={`unit-${uid}`} data-state={entry.state}>
      <span class={given ? "dot given" : "dot"} aria-hidden="true" />
      <Who uid={uid} one={one} />
      <span class={given ? "c-id" : "c-id second"}>
        {given ? words.find.id(entry.servoId) : entry.state === "skipped" ? strings.skipped : strings.noId}
      </span>
      <span class="c-label">
        {one?.online === false ? <span class="k-failure">{strings.offline}</span> : entry.label}
      </span>
      {entry.state === "open" ? (
        <button
          type="button"
          class="button"
          aria-label={strings.wiggleName(name)}
          disabled={!up.value || stopped.value || wiggling.value}
          onClick={props.onWiggle}
        >
          <Icon name="wiggle" /> {strings.wiggle}
        </button>
      ) : (
        <button type="button" class="button" aria-label={strings.changeName(name)} onClick={props.onOpen}>
          {strings.change}
        </button>
      )}
    </li>
  );
}

interface ActiveProps {
  uid: string;
  entry: Entry;
  place: string;
  last: boolean;
  onGive: () => void;
  onSkip: () => void;
}

function Active({ uid, entry, place, last, onGive, onSkip }: ActiveProps) {
  const box = useRef<HTMLLIElement>(null);
  const wanted = useSignal(false);
  const fold = useSignal(entry.nodeId !== "");
  const idId = useId();
  const wrongId = useId();
  useEffect(() => watch(uid), [uid]);
  // The dial shows its limits.
  useEffect(() => {
    void sheetOf(uid).load();
  }, [uid]);
  useEffect(() => {
    suggest(uid);
    box.current?.scrollIntoView({ block: "nearest" });
    // The focus moves to Wiggle of the next servo, which is pressed next.
    if (draft.peek().chosen.some(other => draft.peek().entries[other]?.state !== "open"))
      box.current?.querySelector<HTMLElement>("[data-testid=wiggle]")?.focus();
  }, []);
  const one = servo(uid);
  const wrong = wrongIds(draft.value, uid, owners.value);
  const shown = wanted.value || entry.servoId !== "" ? wrong.servoId : null;
  const tried = wiggled.value?.uid === uid;
  const give = () => {
    wanted.value = true;
    if (wrong.nodeId !== null) fold.value = true;
    if (wrong.servoId === null && wrong.nodeId === null) onGive();
  };
  const step = (by: number) => {
    const next = (wholeNumber(entry.servoId) ?? Number.NaN) + by;
    if (Number.isInteger(next))
      changeEntry(uid, { servoId: String(Math.min(HIGHEST_ID, Math.max(LOWEST_ID, next))) });
  };
  return (
    <li ref={box} class="c-active" data-testid={`unit-${uid}`} data-state="active" aria-current="true">
      {one && <LiveDial one={one} size={120} />}
      <form
        class="c-form"
        onSubmit={event => {
          event.preventDefault();
          give();
        }}
      >
        <div class="c-title">
          <h2>{one?.serial ?? one?.name ?? uid.slice(0, 8)}</h2>
          <span class="dim">
            {one ? modelName(one) : text.servos.unknownModel}, {`…${uid.slice(-4)}`}
          </span>
          <span class="second place">{place}</span>
        </div>
        <Wiggling uid={uid} />
        <div class="c-fields">
          <div class="c-field">
            <label for={idId}>{strings.servoId}</label>
            <span class="stepper" data-wrong={shown !== null}>
              <button type="button" aria-label={strings.less} onClick={() => step(-1)}>
                −
              </button>
              <input
                id={idId}
                data-testid="servo-id"
                inputMode="numeric"
                autocomplete="off"
                value={entry.servoId}
                aria-invalid={shown !== null}
                aria-describedby={shown === null ? undefined : wrongId}
                onInput={event => changeEntry(uid, { servoId: event.currentTarget.value })}
              />
              <button type="button" aria-label={strings.more} onClick={() => step(1)}>
                +
              </button>
            </span>
          </div>
          <TextField
            label={strings.label}
            hint={strings.labelHint}
            at={cell(entry.label, label => changeEntry(uid, { label }))}
            longest={LONGEST_LABEL}
            class="wide"
            testid="label"
          />
        </div>
        {shown !== null && (
          <div id={wrongId}>
            <Note>{shown}</Note>
          </div>
        )}
        <div class="c-do">
          <button
            type="button"
            class="button"
            data-testid="wiggle"
            disabled={!up.value || stopped.value || wiggling.value || one?.online === false}
            onClick={() => void wiggle(uid)}
          >
            <Icon name="wiggle" /> {tried ? strings.again : strings.wiggle}
          </button>
          <Button testid="skip" onClick={onSkip}>
            {strings.skip}
          </Button>
          <button type="submit" class="button primary" data-testid="give">
            {last ? strings.last : strings.next}
          </button>
        </div>
        <button
          type="button"
          class="link c-more"
          aria-expanded={fold.value}
          data-testid="more"
          onClick={() => {
            fold.value = !fold.value;
          }}
        >
          {strings.fold}
        </button>
        {fold.value && (
          <TextField
            label={strings.nodeId}
            at={cell(entry.nodeId, nodeId => changeEntry(uid, { nodeId }))}
            number
            short
            error={wrong.nodeId}
            help={strings.nodeHint}
            testid="node-id"
          />
        )}
      </form>
    </li>
  );
}

/** Status of the wiggle while it runs. */
function Wiggling({ uid }: { uid: string }) {
  const last = wiggled.value?.uid === uid ? wiggled.value : null;
  return (
    <p class="c-says" role="status" data-testid="wiggle-says" data-phase={last?.phase ?? "none"}>
      {stopped.value ? (
        <>
          <Glyph kind="warning" /> <span>{strings.stopped}</span>
        </>
      ) : last === null ? (
        <>
          <span class="dot" aria-hidden="true" /> <span class="second">{strings.notYet}</span>
        </>
      ) : last.phase === "requesting" || last.phase === "moving" ? (
        <>
          <span class="k-intent">
            <Spinner />
          </span>
          <span>{last.phase === "requesting" ? strings.requesting : strings.moving(angle(last.around))}</span>
        </>
      ) : last.phase === "moved" ? (
        <>
          <Glyph kind="ok" /> <span>{strings.moved(angle(last.low), angle(last.high))}</span>
        </>
      ) : (
        <>
          <Glyph kind="failure" /> <span>{strings.refused(last.why)}</span>
        </>
      )}
    </p>
  );
}
