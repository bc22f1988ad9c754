/** The start of the page, once its language is there: mounts it, and starts what lives as long as it does. */
import { effect } from "@preact/signals";
import { render } from "preact";
import { App } from "./app";
import { startBusHistory } from "./state/bus-now";
import { startClock } from "./state/clock";
import { startDoctor } from "./state/doctor";
import { hasDrafts } from "./state/draft-store";
import { listen } from "./state/keys";
import { connection, startLink } from "./state/link";
import { startMotion } from "./state/motion";
import { askBeforeLeaving } from "./state/reload";
import { startRoute } from "./state/route";
import { startSession } from "./state/session";
import { pressStop } from "./state/stop";
import { startTheme } from "./state/theme";
import { fetchAll, watchStyles } from "./ui/lazy";

startTheme();
askBeforeLeaving(hasDrafts);
startSession();
startRoute();
startClock();
listen(window, pressStop);
startMotion();
startBusHistory();
startDoctor();
startLink();

watchStyles();
const root = document.getElementById("app");
if (root) render(<App />, root);

// After the first connection, and again after each: what is not there when the server goes away cannot be opened then.
effect(() => {
  if (connection.value === 0) return;
  void fetchAll().then(all => {
    if (all) document.documentElement.dataset.loaded = "all";
  });
});
