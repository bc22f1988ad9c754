/** Row height of the list: chosen by the user, stored in the browser. */
import { kept } from "../bench/kept";

export type Density = "list" | "compact";

export const density = kept<Density>("hornbill.density", found => (found === "compact" ? "compact" : "list"));
