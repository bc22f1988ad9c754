/** Begins: style at once, then the language, then the page in it. */
import { startLanguage } from "./text/language";
import "./style/layers.css";
import "./style/tokens.css";
import "./style/base.css";
import "./frame/frame.css";
import "./frame/bar.css";
import "./frame/bands.css";
import "./servos/servos.css";
import "./parameters/parameters.css";
import "./change/rows.css";
import "./kit/controls.css";
import "./change/save-bar.css";
import "./servo/side.css";
import "./motion/motion.css";
import "./kit/dialog.css";
import "./style/narrow.css";
import "./style/japanese.css";
import "./style/print.css";

startLanguage()
  .then(() => import("./start"))
  .catch(() => {
    // Most likely the server went away, or was updated, between the page and its files: there are no words yet.
    const root = document.getElementById("app");
    if (root) root.textContent = "hornbill could not load this page. Load it again.";
  });
