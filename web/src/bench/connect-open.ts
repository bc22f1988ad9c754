/** Whether the Connect dialog is open, on whatever page. */
import { signal } from "@preact/signals";

export const connectOpen = signal(false);
