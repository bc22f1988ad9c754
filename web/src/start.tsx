/** Owns the start of the page, once its language is there: mounts it, and starts what lives as long as it does. */
import { render } from "preact";
import { App } from "./app";
import { startBusHistory } from "./state/bus-now";
import { startClock } from "./state/clock";
import { startDoctor } from "./state/doctor";
import { listen } from "./state/keys";
import { startLink } from "./state/link";
import { startMotion } from "./state/motion";
import { startRoute } from "./state/route";
import { startSession } from "./state/session";
import { pressStop } from "./state/stop";
import { startTheme } from "./state/theme";

startTheme();
startSession();
startRoute();
startClock();
listen(window, pressStop);
startMotion();
startBusHistory();
startDoctor();
startLink();

const root = document.getElementById("app");
if (root) render(<App />, root);
