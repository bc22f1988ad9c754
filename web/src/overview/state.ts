/** What the columns of the Overview tell one another. */
import { signal } from "@preact/signals";

/** When the last snapshot was taken from here, seconds since 1970. */
export const taken = signal<{ uid: string; at: number } | null>(null);

/** Grows with each note that was written from here: the history has one more. */
export const written = signal(0);
