/** How measured quantities are shown: unit, scale, and decimals that suit their interval. */
import type { MechanicsValue } from "../api/lab-types";

interface Shown {
  unit: string;
  scale: number;
  decimals: number;
}

/** Shares of stall torque. */
const SHARES: ReadonlySet<string> = new Set(["breakaway", "coulomb", "viscous"]);

/** Shares are shown in %, times in ms, the rest in the unit of the server; two digits of the interval are shown. */
export function scaled({ name, unit, estimate }: Pick<MechanicsValue, "name" | "unit" | "estimate">): Shown {
  const shown = SHARES.has(name)
    ? { unit: "%", scale: 100 }
    : unit === "s"
      ? { unit: "ms", scale: 1000 }
      : name === "inertia"
        ? { unit: "×", scale: 1 }
        : { unit, scale: 1 };
  const half = estimate ? ((estimate.high - estimate.low) / 2) * shown.scale : 0;
  return { ...shown, decimals: half <= 0 ? 2 : Math.min(4, Math.max(0, 1 - Math.floor(Math.log10(half)))) };
}
