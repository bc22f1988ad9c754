/** Overlays of a 3D picture at the positions of its objects: names, and draggable parts. */
import { type ReadonlySignal, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Sight } from "../bench/view-link";
import { Grips } from "./grips";
import { Names } from "./names";
import type { Size } from "./wall-projection";

interface Props {
  sight: ReadonlySignal<Sight | null>;
  /** The draggable servo and its angle; null for a recording. */
  live: { uid: string; angle: number | null } | null;
  names?: ReadonlyMap<string, string>;
}

export function Overlay({ sight, live, names }: Props) {
  const place = useRef<HTMLDivElement>(null);
  const size = useSignal<Size | null>(null);
  useEffect(() => {
    const watcher = new ResizeObserver(entries => {
      const box = entries.at(-1)?.contentRect;
      if (box) size.value = { width: box.width, height: box.height };
    });
    if (place.current) watcher.observe(place.current);
    return () => watcher.disconnect();
  }, []);
  const seen = sight.value;
  const [front] = seen?.servos ?? [];
  return (
    <div ref={place} class="view-over">
      {seen && size.value && <Names sight={seen} size={size.value} {...(names ? { names } : {})} />}
      {seen && size.value && live && front?.uid === live.uid && (
        <Grips key={live.uid} {...live} stand={front} sight={sight} size={size.value} />
      )}
    </div>
  );
}
