/** The Torque off button of a servo's page: without lease or question. */

import { useSignal } from "@preact/signals";
import { servo } from "../bench/fleet";
import { torqueOff } from "../change/torque";
import { Button } from "../kit/button";
import { text } from "../text";

export function TorqueOff({ uid }: { uid: string }) {
  const problem = useSignal<string | null>(null);
  const one = servo(uid);
  const press = async () => {
    problem.value = null;
    const why = await torqueOff(uid);
    if (why !== null) problem.value = text.params.torqueOffFailed(why);
  };
  return (
    <>
      {problem.value && (
        <span class="small k-failure" role="alert">
          {problem.value}
        </span>
      )}
      <Button
        live
        testid="torque-off"
        disabled={one?.online !== true || one.output.state === "off"}
        onClick={() => void press()}
      >
        {text.params.torqueOff}
      </Button>
    </>
  );
}
