/** Which servo's outside changes are looked at. */
import { signal } from "@preact/signals";

export const openDrift = signal<string | null>(null);
