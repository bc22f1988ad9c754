/** State shared by the columns of the Overview. */
import { signal } from "@preact/signals";

/** Time of the last snapshot taken here, seconds since 1970. */
export const taken = signal<{ uid: string; at: number } | null>(null);

/** Counts notes written here: the history has a new entry. */
export const written = signal(0);
