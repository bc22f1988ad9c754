/** How high the rows of the list are: chosen by hand, kept for this browser. */
import { kept } from "../bench/kept";

export type Density = "list" | "compact";

export const density = kept<Density>("hornbill.density", found => (found === "compact" ? "compact" : "list"));
