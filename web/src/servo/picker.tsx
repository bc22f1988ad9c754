/** The name of a servo as a button that opens the list of servos: by ID, name, model and health, with a search. */
import { useSignal } from "@preact/signals";
import { useEffect, useId, useLayoutEffect, useRef } from "preact/hooks";
import { all, isFound, type KnownServo, nameOf } from "../bench/fleet";
import { NONE } from "../bench/format";
import { modelName } from "../bench/model";
import { go, sameFor } from "../bench/route";
import { conditionHere } from "../bench/servo-condition";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { usePopup } from "../kit/popup";
import { text } from "../text";

export function ServoPicker({ one }: { one: KnownServo }) {
  const { open, box, close } = usePopup<HTMLDivElement>();
  const id = useId();
  if (all.value.length < 2) return <h1>{nameOf(one)}</h1>;
  return (
    <div ref={box} class="picker">
      <h1>
        <button
          type="button"
          data-testid="choose-servo"
          title={text.params.choose}
          aria-haspopup="listbox"
          aria-expanded={open.value}
          onClick={() => {
            open.value = !open.peek();
          }}
        >
          {nameOf(one)} <Icon name="down" size={16} />
        </button>
      </h1>
      {open.value && (
        <List
          id={id}
          one={one}
          onChoose={uid => {
            close();
            if (uid !== one.uid) go(sameFor(uid));
          }}
        />
      )}
    </div>
  );
}

/** The keys of the search box act on the list below it. */
const COMBOBOX = { role: "combobox", "aria-expanded": true } as object;

function List({ id, one, onChoose }: { id: string; one: KnownServo; onChoose: (uid: string) => void }) {
  const typed = useSignal("");
  const marked = useSignal(one.uid);
  const input = useRef<HTMLInputElement>(null);
  const found = all.value.filter(each => isFound(each, typed.value));
  const at = Math.max(
    0,
    found.findIndex(each => each.uid === marked.value),
  );
  useLayoutEffect(() => input.current?.focus(), []);
  useEffect(() => {
    document.getElementById(`${id}-${at}`)?.scrollIntoView({ block: "nearest" });
  }, [at]);
  const move = (event: KeyboardEvent) => {
    const chosen = found[at];
    if (event.key === "Enter" && chosen) onChoose(chosen.uid);
    const by = event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : 0;
    if (by !== 0) marked.value = found[(at + by + found.length) % found.length]?.uid ?? one.uid;
    if (by !== 0 || event.key === "Enter") event.preventDefault();
  };
  return (
    <div class="picker-list">
      <label class="search">
        <Icon name="search" size={16} />
        <span class="hidden-text">{text.servos.search}</span>
        <input
          ref={input}
          type="search"
          {...COMBOBOX}
          aria-controls={id}
          aria-activedescendant={found.length > 0 ? `${id}-${at}` : undefined}
          placeholder={text.servos.search}
          autocomplete="off"
          data-testid="choose-search"
          value={typed.value}
          onInput={event => {
            typed.value = event.currentTarget.value;
          }}
          onKeyDown={move}
        />
      </label>
      <div role="listbox" id={id} aria-label={text.params.choose} tabIndex={-1}>
        {found.map((each, index) => (
          <Option
            key={each.uid}
            id={`${id}-${index}`}
            one={each}
            here={each.uid === one.uid}
            marked={index === at}
            onChoose={() => onChoose(each.uid)}
          />
        ))}
      </div>
      {found.length === 0 && <p class="second small">{text.servos.nothingFound}</p>}
    </div>
  );
}

interface OptionProps {
  id: string;
  one: KnownServo;
  here: boolean;
  marked: boolean;
  onChoose: () => void;
}

function Option({ id, one, here, marked, onChoose }: OptionProps) {
  const { kind, headline } = conditionHere(one);
  return (
    // biome-ignore lint/a11y/useKeyWithClickEvents: the keys are those of the search box, which keeps the focus
    <div
      id={id}
      role="option"
      tabIndex={-1}
      aria-selected={here}
      data-marked={marked}
      data-testid={`choose-${one.uid}`}
      onClick={onChoose}
    >
      <span class="right second">{one.servo_id ?? NONE}</span>
      <b>{nameOf(one)}</b>
      <span class="second">{modelName(one)}</span>
      <span class="picker-health">
        <Glyph kind={kind} size={14} /> {headline}
      </span>
    </div>
  );
}
