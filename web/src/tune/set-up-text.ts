/** The set-up of a run in words. */
import type { SetUp } from "../api/lab-types";
import { number, signed, withUnit } from "../bench/format";
import { tune as words } from "./words";

/** "Arm 60 mm with 120 g, vice, 7.4 V, 24 °C"; null if nothing is stated. */
export function setUpText(of: SetUp): string | null {
  const strings = words.setUp;
  const unit = (value: number | null | undefined, name: string, show = shortest) =>
    value === null || value === undefined ? null : withUnit(show(value), name);
  const arm = unit(of.arm_mm, "mm");
  const mass = unit(of.mass_g, "g");
  const inertia = unit(of.inertia_gm2, "g·m²");
  const load = unit(of.load_nm, "N·m", value => signed(value, decimals(value)));
  const parts = [
    arm && mass
      ? strings.armWithMass(arm, mass)
      : arm
        ? strings.armOf(arm)
        : mass
          ? strings.massOf(mass)
          : null,
    inertia && strings.inertiaOf(inertia),
    load && strings.loadOf(load),
    of.mounting && strings.mountings[of.mounting],
    unit(of.supply_v, "V"),
    unit(of.ambient_c, "°C"),
  ].filter(Boolean);
  if (parts.length === 0) return null;
  const text = parts.join(words.list);
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** At most three decimals, without zeros at the end. */
function decimals(value: number): number {
  return (String(Math.round(value * 1000) / 1000).split(".")[1] ?? "").length;
}

function shortest(value: number): string {
  return number(value, decimals(value));
}
