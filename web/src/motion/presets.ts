/** Presets: two angles of each servo to come back to. They are this browser's, as favourites are; the server knows none. */
import { signal } from "@preact/signals";
import { kept } from "../bench/kept";

export const PRESETS = ["a", "b"] as const;
export type Preset = (typeof PRESETS)[number];
type Angles = Partial<Record<Preset, number>>;

const angles = kept<Readonly<Record<string, Angles>>>("hornbill.presets", read);

/** One that is stored already, to be asked about before it is replaced: from what angle, by what. */
export const replacing = signal<{ uid: string; preset: Preset; from: number; by: number } | null>(null);

export function presetOf(uid: string, preset: Preset): number | null {
  return angles.value[uid]?.[preset] ?? null;
}

/** Stores an angle, degrees; asks first where another one would be lost. */
export function wishPreset(uid: string, preset: Preset, angle: number): void {
  const from = presetOf(uid, preset);
  const by = Math.round(angle * 10) / 10; // a step of the register
  if (from === null) storePreset(uid, preset, by);
  else if (from !== by) replacing.value = { uid, preset, from, by };
}

export function storePreset(uid: string, preset: Preset, angle: number): void {
  const before = angles.peek();
  angles.value = { ...before, [uid]: { ...before[uid], [preset]: angle } };
}

function read(found: unknown): Readonly<Record<string, Angles>> {
  const all = typeof found === "object" && found !== null ? Object.entries(found) : [];
  return Object.fromEntries(
    all.map(([uid, one]: [string, Angles | null]) => [
      uid,
      Object.fromEntries(
        PRESETS.flatMap(each => (Number.isFinite(one?.[each]) ? [[each, one?.[each]]] : [])),
      ),
    ]),
  );
}
