/** The note under the bar while hornbill is a guest or observer: who commands what, and what Stop reaches. */
import { type Signal, useSignal } from "@preact/signals";
import { bus, stop } from "../bench/bench";
import { all, nameOf, peekServo } from "../bench/fleet";
import { noteText } from "../bench/note-text";
import { elsewhere } from "../bench/role";
import { pathOf } from "../bench/route";
import { Button } from "../kit/button";
import { follow } from "../kit/follow";
import { Icon } from "../kit/icon";
import { RoleDialog } from "./dialog";
import { roleWords as words } from "./words";
import "./role.css";

export function RoleBand() {
  const changing = useSignal(false);
  const why = useSignal(false);
  const role = bus.value?.role;
  if (role !== "guest" && role !== "observer") return null;
  return (
    <section class="role-band" data-testid="role-band">
      <Icon name="guest" />
      <p>
        {role === "guest" ? <GuestLines why={why} /> : <ObserverLines />}
        {why.value && <span class="role-why">{words.reachWhy}</span>}
      </p>
      <a
        class="button"
        href={AUTOPILOT}
        data-testid="to-autopilot"
        onClick={event => follow(event, AUTOPILOT)}
      >
        {words.toAutopilot}
      </a>
      <Button
        testid="change-role"
        onClick={() => {
          changing.value = true;
        }}
      >
        {words.change}
      </Button>
      {changing.value && (
        <RoleDialog
          onClose={() => {
            changing.value = false;
          }}
        />
      )}
    </section>
  );
}

const AUTOPILOT = pathOf("bus", null, "autopilot");

function GuestLines({ why }: { why: Signal<boolean> }) {
  const state = bus.value;
  const commanded = elsewhere.value;
  const nodes = [...new Set(commanded.flatMap(one => (one.commanded_by ?? []).map(by => by.node_id)))];
  const reached = (stop.value?.reaches ?? []).map(uid => nameOf(peekServo(uid))).join(", ");
  const reason = state?.role_reason ? noteText(state.role_reason, "heard", state.role_reason_params) : "";
  return (
    <>
      <b>
        {commanded.length === 0
          ? words.guest(reason)
          : words.guestCommanded(
              nodes
                .sort((a, b) => a - b)
                .map(words.node)
                .join(", "),
              commanded.length,
              all.value.length,
            )}
      </b>{" "}
      <span class="wide-only">{words.guestLine} </span>
      <b>{words.reaches(reached)}</b>{" "}
      <button
        type="button"
        class="link"
        aria-expanded={why.value}
        data-testid="why-not-all"
        onClick={() => {
          why.value = !why.value;
        }}
      >
        {words.notAll}
      </button>
    </>
  );
}

function ObserverLines() {
  return (
    <>
      <b>{words.observer}</b> <span class="wide-only">{words.observerLine} </span>
      {words.observerStop}
    </>
  );
}
