/** The serial line of the connected adapter: baud rate, budget, and notes on the adapter. */
import type { Bus } from "../api/types";
import { grouped, number, withUnit } from "../bench/format";
import { Glyph } from "../kit/glyph";
import { busWords as words } from "./words";

const strings = words.line;

type Note = Bus["notes"][number];

/** A note in the page's language, by its code; the server's text where the page has none. */
export function lineNote(note: Note): string {
  const known = strings.notes[note.code];
  return known === undefined ? note.text : known(note.params);
}

/** Possible causes when nothing was received, with remedies. */
export function nothingReceived(state: Bus): string[] {
  const line = state.serial_line;
  const lines: string[] = [strings.checkBus];
  if (line && line.budget !== null && !line.confirmed) {
    lines.unshift(
      line.found ? strings.tryingRates(grouped(line.baud)) : strings.leaveOut(grouped(line.baud)),
    );
  }
  return lines;
}

/** A short sentence for the head of the bus page; null without a serial line. */
export function lineFact(state: Bus): string | null {
  const line = state.serial_line;
  if (!line) return null;
  if (line.budget === null) return strings.usb;
  return strings.fact(grouped(line.baud), grouped(line.budget));
}

export function LineFacts({ state }: { state: Bus }) {
  const line = state.serial_line;
  if (!line && state.frame_gap_ms === 0 && state.notes.length === 0) return null;
  return (
    <div class="line-facts" data-testid="line-facts">
      <dl>
        {line && (
          <>
            <Fact name={strings.baud} testid="line-baud">
              {line.budget === null ? strings.usb : strings.baudOf(grouped(line.baud))}
              {line.budget !== null && (
                <small>{line.confirmed ? strings.how(line.found) : strings.unconfirmed}</small>
              )}
            </Fact>
            {line.serial_number !== null && (
              <Fact name={strings.serialNumber} testid="line-serial">
                <span class="mono">{line.serial_number}</span>
              </Fact>
            )}
            {line.budget !== null && (
              <Fact name={strings.budget} testid="line-budget">
                {strings.framesPerSecond(grouped(line.budget))}
                <small>
                  {state.limited_by === "serial_line" ? strings.slower : strings.faster}
                  {line.load_pct !== null && strings.inUse(withUnit(number(line.load_pct, 0), "%"))}
                </small>
              </Fact>
            )}
          </>
        )}
        {state.frame_gap_ms > 0 && (
          <Fact name={strings.gap} testid="line-gap">
            {withUnit(number(state.frame_gap_ms, state.frame_gap_ms % 1 ? 1 : 0), "ms")}
          </Fact>
        )}
      </dl>
      {state.notes.length > 0 && (
        <ul class="line-notes" data-testid="line-notes" aria-label={strings.notesTitle}>
          {state.notes.map(note => (
            <li key={note.code}>
              <Glyph kind="notice" size={14} />
              <span>{lineNote(note)}</span>
            </li>
          ))}
        </ul>
      )}
    </div>
  );
}

function Fact({
  name,
  testid,
  children,
}: {
  name: string;
  testid: string;
  children: preact.ComponentChildren;
}) {
  return (
    <div data-testid={testid}>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}
