/** As guest: the button of the stop band that also stops servos which the autopilot commands. */
import { useSignal } from "@preact/signals";
import { callApi } from "../api/client";
import { bus, stop } from "../bench/bench";
import { all } from "../bench/fleet";
import { holder } from "../bench/holder";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { roleWords as words } from "./words";

export function StopAll() {
  const confirming = useSignal(false);
  const online = all.value.filter(one => one.online).length;
  if (bus.value?.role !== "guest" || stop.value?.reach !== "own" || online === 0) return null;
  return (
    <>
      <Button
        testid="stop-all"
        look="danger"
        onClick={() => {
          confirming.value = true;
        }}
      >
        {words.everyone(online)}
      </Button>
      {confirming.value && (
        <Confirm
          title={words.everyoneTitle}
          verb={words.everyoneVerb}
          danger
          testid="stop-all-dialog"
          actId="confirm-stop-all"
          act={async () => {
            stop.value = await callApi("POST", "/stop", {
              query: { by: holder() },
              body: { mode: "off", reason: "stop_button", everyone: true },
            });
          }}
          onClose={() => {
            confirming.value = false;
          }}
        >
          <p>{words.everyoneText}</p>
        </Confirm>
      )}
    </>
  );
}
