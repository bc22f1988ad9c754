/** True while the Connect dialog is open, on any page. */
import { signal } from "@preact/signals";

export const connectOpen = signal(false);
