/** The button that restores outputs which Stop, motion or a page switched off: its dialog opens after a dry run. */
import { useSignal } from "@preact/signals";
import { motion } from "../bench/motion";
import { Button } from "../kit/button";
import { Spinner } from "../kit/icon";
import { Note } from "../kit/note";
import { text } from "../text";
import { planRestore } from "./restoring";

interface Props {
  /** Null for every servo that can be restored. */
  uids: readonly string[] | null;
  /** Told why it cannot be, in words; null when it is tried again. */
  onRefused: (why: string | null) => void;
  testid: string;
}

export function RestoreButton({ uids, onRefused, testid }: Props) {
  const busy = useSignal(false);
  const { phase } = motion.value;
  const look = async () => {
    busy.value = true;
    onRefused(null);
    onRefused(await planRestore(uids));
    busy.value = false;
  };
  return (
    <Button
      live
      testid={testid}
      disabled={busy.value || (phase !== "off" && phase !== "held")}
      onClick={() => void look()}
    >
      {busy.value && <Spinner />}
      {text.output.restore}
    </Button>
  );
}

/** Why the dry run was refused, where the button stands in a line of its own. */
export function RestoreRefused({ why }: { why: string | null }) {
  if (why === null) return null;
  return <Note testid="restore-refused">{why}</Note>;
}
