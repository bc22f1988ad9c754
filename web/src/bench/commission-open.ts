/** The commissioning job that the Commission page shows, when opened from another page. */
import { signal } from "@preact/signals";

export const openCommissioning = signal<string | null>(null);
