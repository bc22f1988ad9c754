/** What a part shows of something asked of the server: read with the part, and what is to be said besides its value. */
import { useEffect, useMemo, useRef } from "preact/hooks";
import { connection } from "../bench/link";
import { Resource } from "../bench/resource";
import { Unread } from "./loaded";

/** Something that a part shows: read when it is shown, with each connection and each change of `again`; another `of` is another. */
export function useResource<T>(
  look: () => Promise<T>,
  again: unknown = null,
  of: unknown = null,
): Resource<T> {
  const newest = useRef(look);
  newest.current = look;
  const found = useMemo(() => new Resource<T>(() => newest.current()), [of]);
  const round = connection.value;
  useEffect(() => void found.load(), [found, round, again]);
  return found;
}

/** What is to be said of it besides its value: that it is being read, or why it could not be. */
export function Loaded<T>({ of, loading = "" }: { of: Resource<T>; loading?: string }) {
  const why = of.problem.value;
  return (
    <>
      <Unread why={why} onAgain={() => void of.load()} />
      {of.value.value === null && why === null && loading !== "" && <p class="w-line second">{loading}</p>}
    </>
  );
}
