/** The list of keyboard shortcuts: those of the current page, and those that work everywhere. */
import { type Page, page } from "../bench/route";
import { Dialog, Quit } from "../kit/dialog";
import { Guides } from "../kit/guide";
import { text } from "../text";
import { keys as words } from "./words";
import "./keys.css";

type Line = readonly [key: string, what: string];

const HERE: Partial<Record<Page, readonly Line[]>> = {
  servos: [words.search, words.rows, words.open, words.tick, words.wiggle],
  matrix: [words.number, words.enter, words.reviewAll, words.saveAll],
  parameters: [
    words.search,
    words.select,
    words.number,
    words.enter,
    words.apply,
    words.save,
    words.undo,
    words.wiggle,
  ],
  motion: [words.jog, words.jogZero, words.jogEnter, words.jogHold, words.wiggle],
  tune: [words.number, words.gainEnter, words.apply, words.wiggle],
  scope: [words.scopeCursors, words.scopeArm, words.scopeMemory],
  bus: [words.search, words.monitor],
  recorder: [words.scrub, words.scrubEnds, words.scroll],
  api: [words.scroll],
};

const PAGES: readonly Line[] = [
  ["g s", text.nav.servos],
  ["g c", text.nav.commission],
  ["g p", text.nav.parameters],
  ["g m", text.nav.motion],
  ["g t", text.nav.tune],
  ["g o", text.nav.scope],
  ["g f", text.nav.faults],
  ["g b", text.nav.bus],
  ["g d", text.nav.recorder],
  ["g r", text.nav.records],
  ["g a", text.nav.api],
];

export function KeysHelp({ onClose }: { onClose: () => void }) {
  return (
    <Dialog
      title={words.title}
      onClose={onClose}
      testid="keys-dialog"
      foot={
        <>
          <Guides places={["contents", "tutorial"]} />
          <span class="grow" />
          <Quit onClose={onClose} />
        </>
      }
    >
      <List title={words.here} lines={HERE[page.value] ?? [words.scroll]} />
      <List title={words.everywhere} lines={words.stop} />
      <p class="small second">{words.composing}</p>
      <List title={words.pages} lines={PAGES} />
    </Dialog>
  );
}

function List({ title, lines }: { title: string; lines: readonly Line[] }) {
  return (
    <>
      <h3 class="keys-title">{title}</h3>
      <dl class="keys">
        {lines.map(([key, what]) => (
          <div key={key + what}>
            <dt>
              {key.split(" ").map(one => (
                <kbd key={one}>{one}</kbd>
              ))}
            </dt>
            <dd>{what}</dd>
          </div>
        ))}
      </dl>
    </>
  );
}
