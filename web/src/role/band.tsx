/** The note under the bar while hornbill is a guest or observer: who commands what, and what Stop reaches. */
import { useSignal } from "@preact/signals";
import { bus, stop } from "../bench/bench";
import { all, nameOf, peekServo } from "../bench/fleet";
import { noteText } from "../bench/note-text";
import { Button } from "../kit/button";
import { Icon } from "../kit/icon";
import { RoleDialog } from "./dialog";
import { roleWords as words } from "./words";
import "./role.css";

export function RoleBand() {
  const changing = useSignal(false);
  const role = bus.value?.role;
  if (role !== "guest" && role !== "observer") return null;
  return (
    <section class="role-band" data-testid="role-band">
      <Icon name="guest" />
      <p>{role === "guest" ? <GuestLines /> : <ObserverLines />}</p>
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

function GuestLines() {
  const state = bus.value;
  const commanded = all.value.filter(one => (one.commanded_by ?? []).length > 0);
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
      {words.guestLine} <b>{words.reaches(reached)}</b>
    </>
  );
}

function ObserverLines() {
  return (
    <>
      <b>{words.observer}</b> {words.observerLine} {words.observerStop}
    </>
  );
}
