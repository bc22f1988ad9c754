/** The save bar: number of changes on a servo, and buttons with their consequences. */
import { up } from "../bench/link";
import { Button } from "../kit/button";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { useKeys } from "../kit/use-keys";
import { actionWords, saving } from "./words";

interface Props {
  name: string;
  staged: number;
  wrong: number;
  ramOnly: number;
  torqueChanged: boolean;
  sideEffect: string;
  busy: "checking" | "applying" | "saving" | null;
  online: boolean;
  /** A change is in progress. */
  changing: boolean;
  problem: string | null;
  onDiscard: () => void;
  onDiff: () => void;
  onApply: () => void;
  onSave: () => void;
}

export function SaveBar(props: Props) {
  const { name, staged, wrong, ramOnly, busy, problem } = props;
  const strings = saving;
  const parts = strings.parts(staged, ramOnly);
  const waiting = !up.value
    ? strings.noLink
    : !props.online
      ? strings.offline(name)
      : props.changing
        ? actionWords.underWay(1)
        : null;
  const waits = busy !== null || waiting !== null;
  const mayApply = !waits && staged > 0;
  const maySave = !waits && staged + ramOnly > 0;
  useKeys({
    "Ctrl+Enter": () => mayApply && props.onApply(),
    "Ctrl+S": () => maySave && props.onSave(),
  });
  return (
    <section
      class="save-bar"
      data-testid="save-bar"
      aria-label={strings.changes(staged + wrong + ramOnly, name)}
    >
      <div class="said">
        <p class="headline">
          {strings.changes(staged + wrong + ramOnly, name)}
          {wrong > 0 && (
            <span class="k-failure plain">
              , <span data-testid="need-look">{strings.invalid(wrong)}</span>
            </span>
          )}
        </p>
        {problem ? (
          <p class="problem small" role="alert">
            <Glyph kind="failure" size={13} /> {problem}
          </p>
        ) : (
          <p class="second small">
            {parts}
            {props.torqueChanged && saving.torqueIsOne}
            {parts !== "" && ". "}
            {wrong > 0 && strings.invalidNever}
          </p>
        )}
      </div>
      {busy && (
        <span class="k-intent working">
          <Spinner /> {strings.working[busy]}
        </span>
      )}
      <Button
        look="plain"
        testid="discard"
        disabled={busy !== null || staged + wrong === 0}
        onClick={props.onDiscard}
      >
        {strings.discard}
      </Button>
      <Button testid="diff" onClick={props.onDiff}>
        {strings.diff}
      </Button>
      <Button look="two" testid="apply" live disabled={!mayApply} onClick={props.onApply}>
        <span>
          {strings.apply(staged)} <kbd class="touch-hide">{strings.ctrlEnter}</kbd>
        </span>
        <small>{waiting ?? strings.applySub}</small>
      </Button>
      <Button look="two primary" testid="apply-save" live disabled={!maySave} onClick={props.onSave}>
        <span>
          {staged > 0 ? strings.save : strings.saveOnly} <kbd class="touch-hide">{strings.ctrlS}</kbd>
        </span>
        <small>{waiting ?? props.sideEffect}</small>
      </Button>
    </section>
  );
}
