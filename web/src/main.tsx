/** Begins: style at once, then the language, then the page in it. */
import { startLanguage } from "./text/language";
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
import "./style/narrow.css";
import "./style/japanese.css";

startLanguage()
  .then(() => import("./start"))
  .catch(() => {
    // Most likely the server went away, or was updated, between the page and its files: there are no words yet.
    const root = document.getElementById("app");
    if (root) root.textContent = "hornbill could not load this page. Load it again.";
  });
