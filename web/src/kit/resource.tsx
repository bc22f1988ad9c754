/** A `Resource` in a component: loaded with it, with its loading and error notes. */
import { useEffect, useMemo, useRef } from "preact/hooks";
import { connection } from "../bench/link";
import { Resource } from "../bench/resource";
import { Unread } from "./loaded";

interface Options {
  /** Load again when this changes. */
  again?: unknown;
  /** A change of this is a new resource. */
  of?: unknown;
  /** Poll at this interval while visible. */
  every_ms?: number;
}

/** A resource of a component: loaded when shown and with each connection. */
export function useResource<T>(look: () => Promise<T>, { again, of, every_ms }: Options = {}): Resource<T> {
  const newest = useRef(look);
  newest.current = look;
  const found = useMemo(() => new Resource<T>(() => newest.current()), [of]);
  // Polling requests with each connection by itself.
  const round = every_ms === undefined ? connection.value : null;
  useEffect(() => {
    if (every_ms !== undefined) return found.watch(every_ms).end;
    void found.load();
  }, [found, round, again, every_ms]);
  return found;
}

/** Loading or error note of a resource. */
export function Loaded<T>({ of, loading = "" }: { of: Resource<T>; loading?: string }) {
  const why = of.problem.value;
  return (
    <>
      <Unread why={why} onAgain={() => void of.load()} />
      {of.value.value === null && why === null && loading !== "" && <p class="w-line second">{loading}</p>}
    </>
  );
}
