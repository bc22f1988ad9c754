/** Mounts the page and starts what lives as long as it does. */
import { render } from "preact";
import { App } from "./app";
import { startBusHistory } from "./state/bus-now";
import { startClock } from "./state/clock";
import { startDoctor } from "./state/doctor";
import { listen } from "./state/keys";
import { startLink } from "./state/link";
import { startMotion } from "./state/motion";
import { startRoute } from "./state/route";
import { pressStop } from "./state/stop";
import { startTheme } from "./state/theme";
import "./style/tokens.css";
import "./style/base.css";
import "./style/frame.css";
import "./style/bar.css";
import "./style/bands.css";
import "./style/servos.css";
import "./style/parameters.css";
import "./style/rows.css";
import "./style/controls.css";
import "./style/save-bar.css";
import "./style/side.css";
import "./style/motion.css";
import "./style/dialog.css";

startTheme();
startRoute();
startClock();
listen(window, pressStop);
startMotion();
startBusHistory();
startDoctor();
startLink();

const root = document.getElementById("app");
if (root) render(<App />, root);
