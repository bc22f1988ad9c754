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
  const said = saving;
  const parts = said.parts(staged, ramOnly);
  const waiting = !up.value
    ? said.noLink
    : !props.online
      ? said.offline(name)
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
      aria-label={said.changes(staged + wrong + ramOnly, name)}
    >
      <div class="said">
        <p class="headline">
          {said.changes(staged + wrong + ramOnly, name)}
          {wrong > 0 && (
            <span class="k-failure plain">
              , <span data-testid="need-look">{said.invalid(wrong)}</span>
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
            {wrong > 0 && said.invalidNever}
          </p>
        )}
      </div>
      {busy && (
        <span class="k-intent working">
          <Spinner /> {said.working[busy]}
        </span>
      )}
      <Button
        look="plain"
        testid="discard"
        disabled={busy !== null || staged + wrong === 0}
        onClick={props.onDiscard}
      >
        {said.discard}
      </Button>
      <Button testid="diff" onClick={props.onDiff}>
        {said.diff}
      </Button>
      <Button look="two" testid="apply" live disabled={!mayApply} onClick={props.onApply}>
        <span>
          {said.apply(staged)} <kbd class="touch-hide">{said.ctrlEnter}</kbd>
        </span>
        <small>{waiting ?? said.applySub}</small>
      </Button>
      <Button look="two primary" testid="apply-save" live disabled={!maySave} onClick={props.onSave}>
        <span>
          {staged > 0 ? said.save : said.saveOnly} <kbd class="touch-hide">{said.ctrlS}</kbd>
        </span>
        <small>{waiting ?? props.sideEffect}</small>
      </Button>
    </section>
  );
}
