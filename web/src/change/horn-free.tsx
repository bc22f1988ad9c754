/** The question before servos restart: what each horn does then, and whether it can turn freely. Asked here alone. */
import { useSignal } from "@preact/signals";
import type { Forecast } from "../api/config-types";
import { nameOf, servo } from "../bench/fleet";
import { text } from "../text";
import { hornLine } from "./horn-forecast";

/** What the server says of one servo's save; `restart` is null where nothing is saved. */
export interface PlannedSave {
  uid: string;
  restart?: Forecast | null;
}

export interface HornFree {
  /** How many horns may turn. */
  count: number;
  /** Whether the action may begin: nothing turns, or somebody said that all of these can. */
  agreed: boolean;
  say: (free: boolean) => void;
}

/** `moves`: false only where it is known that the horn is not turned. A yes holds for just these servos. */
export function useHornFree(restarts: readonly { uid: string; moves: boolean }[]): HornFree {
  const said = useSignal<string | null>(null);
  const moving = restarts.filter(one => one.moves).map(one => one.uid);
  const about = moving.join(" ");
  return {
    count: moving.length,
    agreed: moving.length === 0 || said.value === about,
    say: free => {
      said.value = free ? about : null;
    },
  };
}

/** The same, of what saves do. What is not said is taken to move. */
export function useFreeAfterSave(saves: readonly PlannedSave[]): HornFree {
  return useHornFree(saves.map(one => ({ uid: one.uid, moves: one.restart?.moves !== false })));
}

export function HornFreeTick({ of, big = false }: { of: HornFree; big?: boolean }) {
  if (of.count === 0) return null;
  return (
    <label class={big ? "tick big" : "tick"}>
      <input
        type="checkbox"
        data-testid="horn-free"
        checked={of.agreed}
        onChange={event => of.say(event.currentTarget.checked)}
      />
      {text.save.free(of.count)}
    </label>
  );
}

/** What each servo does after a save, and the tick below. */
export function AfterSave({ saves, free }: { saves: readonly PlannedSave[]; free: HornFree }) {
  if (saves.length === 0) return null;
  return (
    <div class="after-save" data-testid="after-save">
      <h3>{text.save.afterSave(saves.length)}</h3>
      <ul>
        {saves.map(one => (
          <li key={one.uid}>
            <b>{nameOf(servo(one.uid))}</b>: {one.restart ? hornLine(one.restart) : text.save.unknownHead}
          </li>
        ))}
      </ul>
      <HornFreeTick of={free} />
    </div>
  );
}
