/** The confirmation before a latched stop is cleared. */
import { Confirm } from "../kit/confirm";
import { text } from "../text";

interface Props {
  /** Names of servos that have not acknowledged. */
  silent: readonly string[];
  act: () => Promise<void>;
  onClose: () => void;
}

export function ClearDialog({ silent, act, onClose }: Props) {
  return (
    <Confirm
      title={text.stop.clearTitle}
      verb={text.stop.clearConfirm}
      danger
      testid="clear-dialog"
      actId="confirm-clear"
      act={act}
      onClose={onClose}
    >
      <p>{text.stop.clearText}</p>
      {silent.length > 0 && (
        <p class="strong">{text.stop.clearSilent(silent.join(", "), silent.length > 1)}</p>
      )}
    </Confirm>
  );
}
