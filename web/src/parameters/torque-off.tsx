/** The Torque off button of a servo's page: needs no lease and asks nothing. */

import { useSignal } from "@preact/signals";
import { ask, problemOf } from "../api/client";
import type { Reading } from "../api/types";
import { problemText } from "../bench/facts";
import { servo } from "../bench/fleet";
import { sheetOf } from "../bench/parameters";
import { Button } from "../kit/button";
import { text } from "../text";

export function TorqueOff({ uid }: { uid: string }) {
  const problem = useSignal<string | null>(null);
  const sheet = sheetOf(uid);
  const one = servo(uid);
  const press = async () => {
    problem.value = null;
    try {
      sheet.put(await ask<Reading>("POST", `/servos/${uid}/torque`, { body: { mode: "off" } }));
    } catch (error) {
      problem.value = text.params.torqueOffFailed(problemText(problemOf(error)));
    }
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
