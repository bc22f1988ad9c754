/**
 * For each file of tests: its own modules, an empty page and no network. What it started ends with it.
 *
 * The files of a worker share one document (`isolate` in vite.config.ts): making one takes longer than the tests.
 */
import { afterAll, vi } from "vitest";

/** What ends the timers and listeners that the modules of this file started. */
const shared = globalThis as { started?: (() => void)[] };
if (shared.started === undefined) {
  const started: (() => void)[] = [];
  shared.started = started;
  for (const target of typeof document === "undefined" ? [] : [globalThis, document]) {
    const add = target.addEventListener.bind(target);
    target.addEventListener = (
      type: string,
      listener: EventListenerOrEventListenerObject,
      options?: AddEventListenerOptions | boolean,
    ) => {
      add(type, listener, options);
      started.push(() => target.removeEventListener(type, listener, options));
    };
  }
  for (const start of ["setTimeout", "setInterval"] as const) {
    const real = globalThis[start] as typeof setTimeout;
    const remembered = (...given: Parameters<typeof real>) => {
      const timer = real(...given);
      started.push(() => clearTimeout(timer));
      return timer;
    };
    Object.assign(globalThis, { [start]: remembered });
  }
  globalThis.fetch = () => Promise.reject(new TypeError("There is no network in tests."));
}

vi.resetModules();
if (typeof document !== "undefined") {
  document.head.replaceChildren();
  document.body.replaceChildren();
  localStorage.clear();
  sessionStorage.clear();
  history.replaceState(null, "", "/");
}
afterAll(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  for (const end of shared.started?.splice(0) ?? []) end();
});
