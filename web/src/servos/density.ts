/** Row height of the list: chosen by the user, stored in the browser. */
import { browserSetting } from "../bench/browser-setting";

export type Density = "list" | "compact";

export const density = browserSetting<Density>("hornbill.density", found =>
  found === "compact" ? "compact" : "list",
);
