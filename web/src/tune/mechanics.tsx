/** Mechanics of a servo with its load: measured quantities with intervals, where they come from, and exports. */
import { useSignal } from "@preact/signals";
import { API, problemOf } from "../api/client";
import type { Mechanics, MechanicsValue } from "../api/lab-types";
import { bus } from "../bench/bench";
import { problemText } from "../bench/facts";
import type { KnownServo } from "../bench/fleet";
import { angle, minute, number, signed, withUnit } from "../bench/format";
import { noteText } from "../bench/note-text";
import { observing } from "../bench/role";
import { Button } from "../kit/button";
import { DataTable } from "../kit/data-table";
import { FilePick } from "../kit/field";
import { Icon } from "../kit/icon";
import { Note } from "../kit/note";
import { dialog } from "./dialogs";
import { scaled } from "./mechanics-units";
import { loadTwin, mechanics, testing } from "./state";
import { tune as words } from "./words";

/** Quantities with a direction. */
const SIGNED = new Set<string>(["load_pct", "stop_cw_deg", "stop_ccw_deg"]);
/** Address of a bus whose servos are simulated. */
const SIMULATED = "memory:";

export function MechanicsPart({ one }: { one: KnownServo }) {
  const strings = words.mechanics;
  const found = mechanics.value;
  const measured = (found?.values.length ?? 0) > 0 || (found?.travel.length ?? 0) > 0;
  return (
    <div data-testid="mechanics">
      <section class="tune-part" aria-label={strings.title}>
        {!measured && <p class="second">{found === null ? words.runs.loading : strings.nothing}</p>}
        {found && measured && <Values of={found} />}
        {found && found.travel.length > 0 && <Travel of={found} />}
        {found && measured && found.unknowable.length > 0 && (
          <details class="tune-alike">
            <summary>{strings.unknowable}</summary>
            <ul class="second small">
              {found.unknowable.map(note => (
                <li key={note.code}>{noteText(note.text, note.code, note.params)}</li>
              ))}
            </ul>
          </details>
        )}
      </section>
      {measured && (
        <section class="tune-part" aria-label={strings.exports}>
          <h3 class="second small">{strings.exports}</h3>
          <p class="tune-exports">
            {(["json", "mujoco", "urdf"] as const).map(format => (
              <a
                key={format}
                class="button"
                href={`${API}/servos/${one.uid}/mechanics/export?format=${format}`}
                download=""
                data-testid={`export-${format}`}
              >
                <Icon name="download" size={15} /> {strings.formats[format]}
              </a>
            ))}
          </p>
        </section>
      )}
      {bus.value?.address?.startsWith(SIMULATED) === true && !observing.value && <LoadTwin uid={one.uid} />}
      <section class="tune-part tune-act">
        <Button
          look="primary"
          live
          testid="mechanics-open"
          disabled={testing.value || observing.value || !one.online}
          onClick={() => {
            dialog.value = "mechanics";
          }}
        >
          {strings.open}
        </Button>
      </section>
    </div>
  );
}

function Values({ of }: { of: Mechanics }) {
  const strings = words.mechanics;
  return (
    <DataTable<MechanicsValue>
      small
      label={strings.title}
      testid="mechanics-values"
      rows={of.values}
      id={row => row.name}
      data={row => ({ testid: `mechanics-${row.name}` })}
      columns={[
        {
          key: "quantity",
          head: strings.quantity,
          name: true,
          cell: row => (
            <>
              {strings.names[row.name] ?? row.name}
              <small class="tune-under">{strings.from(minute(row.at), row.run)}</small>
            </>
          ),
        },
        {
          key: "value",
          head: strings.value,
          right: true,
          cell: row =>
            row.estimate ? (
              <>
                {figure(row)}
                <small class="tune-under">{interval(row)}</small>
              </>
            ) : (
              <small class="tune-under">
                {row.note ? noteText(row.note.text, row.note.code, row.note.params) : strings.notMeasured}
              </small>
            ),
        },
      ]}
    />
  );
}

function figure(row: MechanicsValue): string {
  const { value = 0 } = row.estimate ?? {};
  const { unit, scale, decimals } = scaled(row);
  return withUnit((SIGNED.has(row.name) ? signed : number)(value * scale, decimals), unit);
}

function interval(row: MechanicsValue): string {
  const { low = 0, high = 0 } = row.estimate ?? {};
  const { scale, decimals } = scaled(row);
  const show = SIGNED.has(row.name) ? signed : number;
  return words.mechanics.interval(show(low * scale, decimals), show(high * scale, decimals));
}

/** Friction along the travel in one sentence, with the angles at which it binds. */
function Travel({ of }: { of: Mechanics }) {
  const strings = words.mechanics;
  const frictions = of.travel.map(point => point.friction_pct);
  const binding = of.travel.filter(point => point.binding).map(point => angle(point.angle_deg));
  const percent = (value: number) => withUnit(number(value, 1), "%");
  return (
    <div data-testid="mechanics-travel">
      <p class="second small">
        {strings.travel(
          angle(of.travel[0]?.angle_deg),
          angle(of.travel.at(-1)?.angle_deg),
          percent(Math.min(...frictions)),
          percent(Math.max(...frictions)),
        )}
      </p>
      {binding.length > 0 && <Note kind="warning">{strings.binds(binding.join(words.list))}</Note>}
    </div>
  );
}

/** Gives the simulated servo the constants of an exported twin. */
function LoadTwin({ uid }: { uid: string }) {
  const strings = words.mechanics;
  const problem = useSignal<string | null>(null);
  const done = useSignal<string | null>(null);
  const load = async (file: File) => {
    problem.value = done.value = null;
    try {
      await loadTwin(uid, await file.text());
      done.value = strings.loaded(file.name);
    } catch (error) {
      problem.value =
        error instanceof SyntaxError ? strings.noTwin(file.name) : problemText(problemOf(error));
    }
  };
  return (
    <section class="tune-part" aria-label={strings.simulator}>
      <p class="second small">{strings.simulatorLead}</p>
      <FilePick label={strings.load} accept=".json" testid="twin-load" onFile={file => void load(file)} />
      <Note testid="twin-problem">{problem.value}</Note>
      <Note kind="ok" testid="twin-loaded">
        {done.value}
      </Note>
    </section>
  );
}
