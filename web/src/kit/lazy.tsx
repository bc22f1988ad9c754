/** Code-split parts of the page: loaded when first shown, or ahead of time. */
import { type Signal, signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { useEffect } from "preact/hooks";
import { ROOT } from "../api/root";
import { connection, up } from "../bench/link";
import { reload } from "../bench/reload";
import { text } from "../text";
import { wordsLoaded } from "../text/language";
import { Button } from "./button";

/** Why a part is missing: the server is unreachable, has another version, or does not deliver it. */
type Cause = "link" | "updated" | "refused";

/** Parts not loaded yet. Parts nested in another are added when it loads. */
const waiting = new Set<() => Promise<boolean>>();

const AGAIN_MS = 2000;

/** A component loaded by `load`: with all others when the page is idle, or when first shown. */
export function lazy<Props extends object>(load: () => Promise<ComponentType<Props>>): ComponentType<Props> {
  const found: Signal<ComponentType<Props> | null> = signal(null);
  const cause = signal<Cause | null>(null);
  let coming: Promise<boolean> | null = null;
  /** Style sheets that failed with this part. */
  const own = new Set<string>();
  const get = async (): Promise<boolean> => {
    const before = new Set(failedSheets());
    try {
      await styles(own);
      const part = await load();
      await wordsLoaded();
      found.value = part;
      cause.value = null;
      waiting.delete(fetchIt);
      return true;
    } catch {
      for (const href of failedSheets()) if (!before.has(href)) own.add(href);
      cause.value = await why();
      return false;
    }
  };
  const fetchIt = () => {
    coming ??= get().finally(() => {
      coming = null;
    });
    return coming;
  };
  waiting.add(fetchIt);
  return function Fetched(props: Props) {
    const round = connection.value;
    const missing = found.value === null;
    useEffect(() => {
      if (!missing) return undefined;
      void fetchIt();
      const again = setInterval(() => {
        if (up.peek() && cause.peek() !== "updated") void fetchIt();
      }, AGAIN_MS);
      return () => clearInterval(again);
    }, [round, missing]);
    const Component = found.value;
    if (Component) return <Component {...props} />;
    return cause.value === null ? null : <Missing cause={cause.value} />;
  };
}

function Missing({ cause }: { cause: Cause }) {
  return (
    <p class="notice-line" role="alert" data-testid="not-loaded" data-cause={cause}>
      {text.lazy[cause]} {cause !== "link" && <Button onClick={() => reload()}>{text.lazy.reload}</Button>}
    </p>
  );
}

/** Load every part in turn while the page is idle. Returns whether all are loaded. */
export async function fetchAll(): Promise<boolean> {
  let all = true;
  for (const fetchIt of waiting) {
    await idle();
    if (!up.peek()) return false;
    if (!(await fetchIt())) all = false;
  }
  return all;
}

function idle(): Promise<void> {
  return new Promise(resolve => {
    if ("requestIdleCallback" in window) requestIdleCallback(() => resolve(), { timeout: 5000 });
    else setTimeout(resolve, 50);
  });
}

const failedLinks = () => [
  ...document.querySelectorAll<HTMLLinkElement>("link[rel=stylesheet][data-failed]"),
];

const failedSheets = () => failedLinks().map(link => link.href);

/**
 * Request style sheets that failed once more, because the loader requests each only once. Rejects if one of `needed`
 * fails again; those of other parts do not matter.
 */
async function styles(needed: ReadonlySet<string>): Promise<void> {
  await Promise.all(
    failedLinks().map(failed => {
      const next = document.createElement("link");
      next.rel = "stylesheet";
      next.href = failed.href;
      return new Promise<void>((resolve, reject) => {
        next.onload = () => resolve();
        next.onerror = () => (needed.has(next.href) ? reject(new Error(next.href)) : resolve());
        failed.replaceWith(next);
      });
    }),
  );
}

/** Record style sheets that failed to load. */
export function watchStyles(): void {
  addEventListener(
    "error",
    event => {
      if (event.target instanceof HTMLLinkElement) event.target.dataset.failed = "";
    },
    true,
  );
}

/** Request the page itself: its first script has a different name in another version. */
async function why(): Promise<Cause> {
  const script = document.querySelector<HTMLScriptElement>("script[type=module][src]");
  try {
    const response = await fetch(`${ROOT}/`, { cache: "no-store", signal: AbortSignal.timeout(5000) });
    if (!response.ok || script === null) return "refused";
    const name = new URL(script.src).pathname.split("/").at(-1) ?? "";
    return (await response.text()).includes(name) ? "refused" : "updated";
  } catch {
    return "link";
  }
}
