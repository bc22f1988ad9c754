/** Keys of a component, active while it is mounted. */
import { useLayoutEffect, useRef } from "preact/hooks";
import { onKey } from "../bench/keys";

/** `acts` by key, as named by `onKey`. The keys are fixed at mount, the actions are the latest. */
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
