/** The gains beside a step test: rows written to RAM only, restoring those of a run, and symptoms with remedies. */
import { useRef } from "preact/hooks";
import { catalog } from "../bench/catalog";
import { servo } from "../bench/fleet";
import { up } from "../bench/link";
import { sheetOf } from "../bench/parameters";
import { go, pathOf } from "../bench/route";
import { ParameterRow } from "../change/row";
import { Button } from "../kit/button";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { useKeys } from "../kit/use-keys";
import { applyGains, discardGains, overlay, stagedGains, stageGains, testing } from "./state";
import { GAINS, gainsToRestore, letter, SYMPTOMS, type Symptom, shown } from "./step-runs";
import { tune as words } from "./words";

const strings = words.gains;

export function TuneGains({ uid }: { uid: string }) {
  const table = useRef<HTMLDivElement>(null);
  const sheet = sheetOf(uid);
  const known = catalog.value;
  const has = sheet.keys.value;
  const rows = GAINS.flatMap(key => (has?.includes(key) ? (known?.rows.get(key) ?? []) : []));
  const busy = testing.value;
  const one = servo(uid);
  const gains = stagedGains(uid).size;
  const drafts = sheet.drafts.map.value;
  const wrong = GAINS.filter(key => drafts.get(key)?.verdict.ok === false).length;
  const unsaved = one?.unsaved.filter(key => (GAINS as readonly string[]).includes(key)).length ?? 0;
  const problem = sheet.trouble.value;
  const mayApply = gains > 0 && wrong === 0 && !busy && sheet.busy.value === null && one?.online === true;
  useKeys({ "Ctrl+Enter": () => mayApply && up.value && void applyGains(uid) });
  // Symptoms seen in a run are listed before the gains, the general list after them.
  const tried = (overlay.value?.runs.length ?? 0) > 0;
  const focus = (key: string) => {
    const row = table.current?.querySelector<HTMLElement>(`#row-${key}`);
    row?.scrollIntoView({ block: "nearest" });
    row?.querySelector<HTMLElement>("input, button")?.focus();
  };
  return (
    <aside class="tune-side" aria-label={strings.title} data-testid="tune-gains">
      {tried && <Hints uid={uid} onRow={focus} />}
      <header>
        <h2>{strings.title}</h2>
        <p class="second small">{strings.lead}</p>
      </header>
      {rows.length === 0 ? (
        <p class="w-line second">{strings.none}</p>
      ) : (
        <div role="table" class="tune-rows" aria-label={strings.table} ref={table}>
          {rows.map(row => (
            <ParameterRow
              key={row.key}
              sheet={sheet}
              row={row}
              locked={busy}
              onGoTo={name => {
                const other = [...(known?.rows.values() ?? [])].find(each => each.name === name);
                if (other) go(pathOf("parameters", uid, other.key));
              }}
              onRetry={() => void applyGains(uid)}
            />
          ))}
        </div>
      )}
      <Note band>{problem}</Note>
      <div class="tune-apply" data-staged={gains + wrong > 0}>
        {gains + wrong > 0 ? (
          <>
            <Button look="plain" testid="gains-discard" onClick={() => discardGains(uid)}>
              {strings.discard}
            </Button>
            <Button
              look="two primary"
              testid="gains-apply"
              live
              disabled={!mayApply}
              onClick={() => void applyGains(uid)}
            >
              {sheet.busy.value ? <Spinner /> : strings.apply(gains)}
              <small>{busy ? strings.busy : strings.applySub}</small>
            </Button>
          </>
        ) : (
          <RestoreButtons uid={uid} />
        )}
      </div>
      {unsaved > 0 && gains + wrong === 0 && (
        <p class="tune-keep">
          <span class="second grow">{strings.unsaved(unsaved)}</span>
          <Button testid="gains-keep" onClick={() => go(pathOf("parameters", uid))}>
            {strings.keep}
          </Button>
        </p>
      )}
      {!tried && <Hints uid={uid} onRow={focus} />}
    </aside>
  );
}

/** Buttons that stage the gains of an overlaid run. */
function RestoreButtons({ uid }: { uid: string }) {
  const sheet = sheetOf(uid);
  const runs = overlay.value?.runs ?? [];
  if (runs.length === 0) return null;
  const restorable = runs.map((run, place) => ({
    letter: letter(place),
    id: run.id,
    values: gainsToRestore(run, key => sheet.held(key)),
  }));
  const same = restorable.filter(one => one.values.size === 0);
  const label = (key: string) => catalog.value?.rows.get(key)?.label ?? key;
  return (
    <>
      <span class="second small grow">
        {same.length > 0 && strings.same(same.map(one => one.letter).join(", "))}
      </span>
      {restorable
        .filter(one => one.values.size > 0)
        .map(one => (
          <Button
            key={one.id}
            testid={`back-to-${one.letter}`}
            title={strings.backHint(one.letter, [...one.values.keys()].map(label).join(", "))}
            disabled={testing.value}
            onClick={() => stageGains(uid, one.values)}
          >
            {strings.back(one.letter)}
          </Button>
        ))}
    </>
  );
}

const ROWS: Record<Symptom, readonly string[]> = {
  hunting: ["angle_p_gain", "angle_dead_band"],
  overshoot: ["angle_d_gain", "angle_p_gain"],
  weak: ["angle_p_gain"],
  small: ["angle_dead_band", "angle_boost"],
  sags: ["overcurrent_limit", "angle_p_gain"],
  smoothed: ["smoothing"],
};

function Hints({ uid, onRow }: { uid: string; onRow: (key: string) => void }) {
  const hints = words.hints;
  const sheet = sheetOf(uid);
  const has = (key: string) => sheet.keys.value?.includes(key) ?? false;
  const brakes = sheet.held("speed_torque_control");
  const advice: Record<Symptom, string> = {
    hunting: hints.hunting,
    overshoot: !has("speed_torque_control")
      ? hints.overshootAbsent
      : brakes === true
        ? hints.overshoot
        : hints.overshootNoD,
    weak: hints.weak,
    small: has("angle_boost") ? hints.smallBoost : hints.small,
    sags: has("overcurrent_limit") ? hints.sags : hints.sagsAbsent,
    smoothed: hints.smoothed,
  };
  const dActs = has("speed_torque_control") && brakes === true;
  const toTry = (symptom: Symptom) =>
    ROWS[symptom].filter(
      (key, place) =>
        has(key) &&
        !(key === "angle_d_gain" && !dActs) &&
        !(symptom === "overshoot" && key === "angle_p_gain" && dActs) &&
        !(symptom === "sags" && place > 0 && has("overcurrent_limit")),
    );
  const seenIn = (symptom: Symptom) =>
    (overlay.value?.runs ?? []).flatMap((run, place) => (shown(run).has(symptom) ? letter(place) : []));
  const runs = overlay.value?.runs.length ?? 0;
  const seen = SYMPTOMS.filter(symptom => seenIn(symptom).length > 0);
  const list = (symptoms: readonly Symptom[]) => (
    <dl>
      {symptoms.map(symptom => {
        const where = seenIn(symptom);
        return (
          <div key={symptom} data-testid={`hint-${symptom}`} data-seen={where.length > 0}>
            <dt>
              {hints.what[symptom]}
              {where.length > 0 && <span class="seen">{hints.seen(where.join(", "))}</span>}
            </dt>
            <dd class="second">
              {advice[symptom]}
              <span class="hint-links">
                {toTry(symptom).map(key => (
                  <button
                    key={key}
                    type="button"
                    class="link"
                    aria-label={hints.goTo(catalog.value?.rows.get(key)?.label ?? key)}
                    onClick={() => onRow(key)}
                  >
                    {catalog.value?.rows.get(key)?.label ?? key}
                  </button>
                ))}
              </span>
            </dd>
          </div>
        );
      })}
    </dl>
  );
  return (
    <section class="tune-hints" aria-label={hints.title}>
      <h2>{hints.title}</h2>
      <p class="second small">{hints.lead}</p>
      {runs === 0 ? (
        list(SYMPTOMS)
      ) : (
        <>
          {seen.length > 0 ? list(seen) : <p class="second none-seen">{hints.noneSeen}</p>}
          <details data-testid="other-hints">
            <summary>{hints.others(SYMPTOMS.length - seen.length)}</summary>
            {list(SYMPTOMS.filter(symptom => !seen.includes(symptom)))}
          </details>
        </>
      )}
    </section>
  );
}
