/** Presets: two stored angles per servo. They are stored in this browser, like favourites, not on the server. */
import { signal } from "@preact/signals";
import { browserSetting } from "../bench/browser-setting";

export const PRESETS = ["a", "b"] as const;
export type Preset = (typeof PRESETS)[number];
type Angles = Partial<Record<Preset, number>>;

const angles = browserSetting<Readonly<Record<string, Angles>>>("hornbill.presets", read);

/** A replacement to be confirmed: the stored angle and the new one. */
export const replacing = signal<{ uid: string; preset: Preset; from: number; by: number } | null>(null);

export function presetOf(uid: string, preset: Preset): number | null {
  return angles.value[uid]?.[preset] ?? null;
}

/** Store an angle, degrees; asks for confirmation if another one is stored. */
export function requestPreset(uid: string, preset: Preset, angle: number): void {
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
