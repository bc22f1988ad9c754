/** What the parts of Records share: instants, what could not be read, what is not there yet. */
import type { ComponentChildren } from "preact";
import { clock, date } from "../bench/format";
import { records as words } from "../text/topics";
import { Button } from "./button";
import { Glyph } from "./glyph";
import { type GuidePlace, Guides } from "./guide";

/** "14:02:31" of today, "2026-03-01 14:02:31" of another day. */
export function instant(utc: number): string {
  const day = date(utc);
  return day === date(Date.now() / 1000) ? clock(utc) : words.at(day, clock(utc));
}

export function Unread({ why, onAgain }: { why: string | null; onAgain: () => void }) {
  if (why === null) return null;
  return (
    <div class="c-note bad" role="alert">
      <Glyph kind="failure" />
      <p class="grow">{words.failed(why)}</p>
      <Button live onClick={onAgain}>
        {words.again}
      </Button>
    </div>
  );
}

interface EmptyProps {
  title: string;
  guides?: readonly GuidePlace[];
  children: ComponentChildren;
}

export function Empty({ title, guides, children }: EmptyProps) {
  return (
    <div class="w-empty">
      <p class="strong">{title}</p>
      <p class="second">{children}</p>
      {guides && <Guides places={guides} />}
    </div>
  );
}

export function Done({ note }: { note: string | null }) {
  if (!note) return null;
  return (
    <div class="c-note well" role="status" data-testid="records-note">
      <Glyph kind="ok" />
      <p class="grow">{note}</p>
    </div>
  );
}

interface ChoiceProps {
  label: string;
  value: string;
  options: readonly { key: string; label: string }[];
  onChoose: (key: string) => void;
  testid: string;
}

/** One of many, by its name. */
export function Choice({ label, value, options, onChoose, testid }: ChoiceProps) {
  return (
    <label class="r-choice">
      <span class="second">{label}</span>
      <select
        class="field"
        data-testid={testid}
        value={value}
        onChange={event => onChoose(event.currentTarget.value)}
      >
        {options.map(one => (
          <option key={one.key} value={one.key}>
            {one.label}
          </option>
        ))}
      </select>
    </label>
  );
}
