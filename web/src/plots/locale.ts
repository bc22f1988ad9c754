/** The language in which uPlot formats numbers; import this before it. */

// WebKit on a Linux machine without a locale names its language "C". No class of Intl accepts that, so uPlot would fail
// to load, and every plot with it.
try {
  Intl.getCanonicalLocales(navigator.language);
} catch {
  Object.defineProperty(navigator, "language", { value: "en", configurable: true });
}

export {};
