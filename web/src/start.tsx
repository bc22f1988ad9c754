/** The start of the page, once its language is loaded: mounts it, and starts what runs as long as it does. */
import { effect } from "@preact/signals";
import { render } from "preact";
import { startBusHistory } from "./bench/bus-now";
import { startClock } from "./bench/clock";
import { startDoctor } from "./bench/doctor";
import { hasDrafts } from "./bench/draft-store";
import { loaded } from "./bench/fleet";
import { listen } from "./bench/keys";
import { connection, startLink } from "./bench/link";
import { startMotion } from "./bench/motion";
import { warnBeforeLeaving } from "./bench/reload";
import { startRoute } from "./bench/route";
import { startSession } from "./bench/session";
import { startSite } from "./bench/site";
import { pressStop } from "./bench/stop";
import { startTheme } from "./bench/theme";
import { App } from "./frame/app";
import { fetchAll, watchStyles } from "./kit/lazy";
import { wordsLoaded } from "./text/language";

startTheme();
warnBeforeLeaving(hasDrafts);
startSession();
startRoute();
startClock();
listen(window, pressStop);
startMotion();
startBusHistory();
startDoctor();
startSite();
startLink();

watchStyles();
const root = document.getElementById("app");
if (root) render(<App />, root);
// Texts for the server's codes, requested again with every part of the page.
wordsLoaded().catch(() => undefined);

// After the first list, and again after each connection: what is not there when the server goes away cannot be opened then.
effect(() => {
  if (connection.value === 0 || !loaded.value) return;
  void fetchAll().then(all => {
    if (all) document.documentElement.dataset.loaded = "all";
  });
});
