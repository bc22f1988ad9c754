/** Sets the theme before the first paint; a plain file of its own so that no inline script is needed. */
(() => {
  let wish = null;
  try {
    wish = localStorage.getItem("hornbill.theme");
  } catch {
    // Storage may be forbidden; the system's wish stands then.
  }
  const dark = wish === "dark" || (wish !== "light" && matchMedia("(prefers-color-scheme: dark)").matches);
  document.documentElement.dataset.theme = dark ? "dark" : "light";
})();
