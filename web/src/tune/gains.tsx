/** The gains beside a measurement: rows written to RAM only, and the same step again. */
import { catalog } from "../bench/catalog";
import { type KnownServo, servo } from "../bench/fleet";
import { up } from "../bench/link";
import { sheetOf } from "../bench/parameters";
import { go, pathOf } from "../bench/route";
import { ParameterRow } from "../change/row";
import { Button } from "../kit/button";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { useKeys } from "../kit/use-keys";
import { gateOf } from "../servo/motion-gate";
import { dialog } from "./dialogs";
import { applyGains, discardGains, runAgain, stagedGains, testing } from "./state";
import { againstStep, stepName, stepOptions } from "./step-dialog";
import { GAINS } from "./step-runs";
import { tune as words } from "./words";

const strings = words.gains;

export function TuneGains({ uid }: { uid: string }) {
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
  return (
    <section aria-label={strings.title} data-testid="tune-gains">
      <p class="second small tune-lead">{strings.lead}</p>
      {rows.length === 0 ? (
        <p class="w-line second">{strings.none}</p>
      ) : (
        <div role="table" class="tune-rows" aria-label={strings.table}>
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
      {gains + wrong > 0 && (
        <div class="tune-apply">
          <Button look="plain" testid="gains-discard" onClick={() => discardGains(uid)}>
            {strings.discard}
          </Button>
          <Button
            look="two"
            testid="gains-apply"
            live
            disabled={!mayApply}
            onClick={() => void applyGains(uid)}
          >
            {sheet.busy.value ? <Spinner /> : strings.apply(gains)}
            <small>{busy ? strings.busy : strings.applySub}</small>
          </Button>
        </div>
      )}
      {one && <Again one={one} gains={gains} busy={busy || sheet.busy.value !== null} />}
      {unsaved > 0 && gains + wrong === 0 && (
        <p class="tune-keep">
          <span class="second grow">{strings.unsaved(unsaved)}</span>
          <Button testid="gains-keep" onClick={() => go(pathOf("parameters", uid))}>
            {strings.keep}
          </Button>
        </p>
      )}
    </section>
  );
}

/** The last step again, with the staged gains: at once while motion is on, else through the dialog that enables it. */
function Again({ one, gains, busy }: { one: KnownServo; gains: number; busy: boolean }) {
  const strings = words.step;
  const options = stepOptions();
  const { on } = gateOf(one);
  const against = againstStep(one, options);
  const name = options ? stepName(options) : "";
  const label = (gains > 0 ? strings.applyAndGo : strings.go)(name);
  return (
    <div class="tune-again">
      {on && against !== null && <Note kind="warning">{against}</Note>}
      <Button
        live
        testid="step-again"
        disabled={busy || (on && against !== null)}
        onClick={() => {
          if (on && options) void runAgain(one.uid, options);
          else dialog.value = "step";
        }}
      >
        {on ? label : `${label}…`}
      </Button>
    </div>
  );
}
