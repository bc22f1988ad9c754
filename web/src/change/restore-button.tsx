/** Button that restores outputs switched off by Stop, motion or a page; its dialog opens after a dry run. */
import { useSignal } from "@preact/signals";
import { motion } from "../bench/motion";
import { Button } from "../kit/button";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { planRestore } from "./restoring";

export interface RestoreProps {
  /** Null for all servos that can be restored. */
  uids: readonly string[] | null;
  /** Called with the reason of a refusal, in words; null on a new attempt. */
  onRefused: (why: string | null) => void;
  testid: string;
}

export function RestoreButton({ uids, onRefused, testid }: RestoreProps) {
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
