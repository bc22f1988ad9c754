/** A `Resource` in a component: loaded with it, with its loading and error notes. */
import { useEffect, useMemo, useRef } from "preact/hooks";
import { connection } from "../bench/link";
import { Resource } from "../bench/resource";
import { Unread } from "./loaded";

/**
 * A resource of a component: loaded when shown, with each connection and each change of `again`, and with `every_ms`
 * also polled while visible. A new `of` is a new resource.
 */
export function useResource<T>(
  look: () => Promise<T>,
  again: unknown = null,
  of: unknown = null,
  every_ms: number | null = null,
): Resource<T> {
  const newest = useRef(look);
  newest.current = look;
  const found = useMemo(() => new Resource<T>(() => newest.current()), [of]);
  const round = connection.value;
  useEffect(() => {
    if (every_ms !== null) return found.watch(every_ms).end;
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
