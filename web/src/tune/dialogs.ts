/** Which dialog of the Tune page is open. */
import { signal } from "@preact/signals";

export type TuneDialog = "step" | "response" | "set-up" | "improve" | "mechanics";

export const dialog = signal<TuneDialog | null>(null);

export function closeDialog(): void {
  dialog.value = null;
}
