/** Keys of a component: while it is shown they do what it last said. */
import { useLayoutEffect, useRef } from "preact/hooks";
import { onKey } from "../bench/keys";

/** `acts` by key, as `onKey` names them; which keys they are is decided when the component is first shown. */
export function useKeys(acts: Readonly<Record<string, () => void>>): void {
  const latest = useRef(acts);
  latest.current = acts;
  useLayoutEffect(() => {
    const forget = Object.keys(acts).map(key => onKey(key, () => latest.current[key]?.()));
    return () => {
      for (const one of forget) one();
    };
  }, []);
}
