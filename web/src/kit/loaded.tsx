/** What several pages show in place of content: loading, load errors, empty states; and times. */
import type { ComponentChildren } from "preact";
import { clock, date } from "../bench/format";
import { text } from "../text";
import { Button } from "./button";
import { type GuidePlace, Guides } from "./guide";
import { Note } from "./note";

/** "14:02:31" of today, "2026-03-01 14:02:31" of another day. */
export function instant(utc: number): string {
  const day = date(utc);
  return day === date(Date.now() / 1000) ? clock(utc) : text.at(day, clock(utc));
}

interface UnreadProps {
  why: string | null;
  onAgain: () => void;
  /** Wraps the cause in a sentence. */
  sentence?: (why: string) => string;
}

/** Load error with a retry button. */
export function Unread({ why, onAgain, sentence = text.unread }: UnreadProps) {
  return (
    <Note
      band
      action={
        <Button live onClick={onAgain}>
          {text.panel.again}
        </Button>
      }
    >
      {why !== null && sentence(why)}
    </Note>
  );
}

/** A page whose content cannot be laid out before it is known. */
export function LoadingPage() {
  return (
    <div class="page">
      <p class="notice-line">{text.empty.loading}</p>
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
  return (
    <Note kind="ok" band testid="records-note">
      {note}
    </Note>
  );
}
