/** Which commissioning job the Commission page shall show, where another page sent somebody there. */
import { signal } from "@preact/signals";

export const openCommissioning = signal<string | null>(null);
