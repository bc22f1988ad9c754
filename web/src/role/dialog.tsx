/** The dialog that changes the connection role, and the same choice in the Connect dialog. */
import { type Signal, useSignal } from "@preact/signals";
import { callApi } from "../api/client";
import type { Bus } from "../api/types";
import { bus } from "../bench/bench";
import { Confirm } from "../kit/confirm";
import { roleWords as words } from "./words";
import "./role.css";

export type Role = NonNullable<Bus["role"]>;
export type RoleChoice = Role | "auto";

const OPENING_MS = 30_000;
const ROLES = ["host", "guest", "observer"] as const;

export function RoleDialog({ onClose }: { onClose: () => void }) {
  const chosen = useSignal<RoleChoice>(bus.value?.role ?? "host");
  return (
    <Confirm
      title={words.title}
      verb={words.verb}
      doing={words.doing}
      ready={chosen.value !== bus.value?.role}
      testid="role-dialog"
      actId="confirm-role"
      act={async () => {
        bus.value = await callApi("PUT", "/bus/role", {
          body: { role: chosen.peek() as Role },
          timeout_ms: OPENING_MS,
        });
      }}
      onClose={onClose}
    >
      <Roles options={ROLES} chosen={chosen} />
      <p class="second">
        {words.torque} {words.remembered}
      </p>
    </Confirm>
  );
}

interface RolesProps<T extends RoleChoice> {
  options: readonly T[];
  chosen: Signal<RoleChoice>;
}

/** One radio button per role, with what it means. */
export function Roles<T extends RoleChoice>({ options, chosen }: RolesProps<T>) {
  return (
    <div role="radiogroup" aria-label={words.label} class="roles">
      {options.map(one => (
        <label key={one} class="role-choice" data-chosen={chosen.value === one}>
          <input
            type="radio"
            name="role"
            data-testid={`role-${one}`}
            checked={chosen.value === one}
            onChange={() => {
              chosen.value = one;
            }}
          />
          <span>
            <b>{words.name[one]}</b>
            <small>{words.means[one]}</small>
          </span>
        </label>
      ))}
    </div>
  );
}
