/** Applies the theme chosen in hornbill's page before the first paint, and stores here what Furo's button chooses. */
(() => {
  const KEY = "hornbill.theme";
  const system = matchMedia("(prefers-color-scheme: dark)");
  const { body, documentElement } = document;

  /** Storage may be forbidden; the choice then lasts as long as this page. */
  function stored(write) {
    try {
      return write ? write() : localStorage.getItem(KEY);
    } catch {
      return null;
    }
  }

  function show() {
    const theme = body.dataset.theme;
    const dark = theme === "dark" || (theme === "auto" && system.matches);
    documentElement.dataset.theme = dark ? "dark" : "light";
  }

  const choice = stored();
  body.dataset.theme = choice === "dark" || choice === "light" ? choice : "auto";
  stored(() => localStorage.setItem("theme", body.dataset.theme));
  show();
  system.addEventListener("change", show);
  new MutationObserver(() => {
    stored(() => localStorage.setItem(KEY, body.dataset.theme));
    show();
  }).observe(body, { attributeFilter: ["data-theme"] });
})();
