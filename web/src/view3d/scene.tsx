/** One 3D frame: supervised, reloaded with each new link, given what to show; it knows whether it could be shown. */
import { type Signal, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { listen } from "../bench/keys";
import { connection } from "../bench/link";
import { pressStop } from "../bench/stop";
import { theme } from "../bench/theme";
import { type Sight, ViewLink, type ViewRequest } from "../bench/view-link";
import { newKey, viewUrl } from "../bench/view-url";
import { measure, quality } from "./quality";

export type SceneState = "loading" | "shown" | "none";

/** Loading timeout: the view is large, and a slow computer takes long. */
const OPENING_MS = 30_000;

interface Props {
  title: string;
  state: Signal<SceneState>;
  /** The selected servo. */
  uid: string | null;
  wall?: ViewRequest["wall"];
  poses?: ViewRequest["poses"];
  resets?: number;
  onPick?: (uid: string) => void;
  /** Near view of the selected servo without the others. */
  alone?: boolean;
  /** Receives the projection of the picture. */
  sight?: Signal<Sight | null>;
  /** View only: no orbiting, not reachable by Tab. */
  still?: boolean;
}

export function Scene({
  title,
  state,
  uid,
  wall,
  poses,
  resets,
  onPick,
  alone,
  sight,
  still = false,
}: Props) {
  const frame = useRef<HTMLIFrameElement>(null);
  const picking = useRef(onPick);
  picking.current = onPick;
  const link = useMemo(
    () =>
      new ViewLink(
        newKey(),
        picked => picking.current?.(picked),
        next => {
          if (sight) sight.value = next;
        },
      ),
    [],
  );
  const seen = useSignal(!document.hidden);
  const drawn = quality.value;
  const look = theme.value;
  const round = connection.value;

  // A hidden tab or a frame outside the viewport is not rendered.
  useEffect(() => {
    let within = true;
    const say = () => {
      seen.value = within && !document.hidden;
    };
    const watcher = new IntersectionObserver(entries => {
      within = entries.at(-1)?.isIntersecting ?? true;
      say();
    });
    if (frame.current) watcher.observe(frame.current);
    document.addEventListener("visibilitychange", say);
    return () => {
      watcher.disconnect();
      document.removeEventListener("visibilitychange", say);
    };
  }, [drawn === null]);

  // The client inside reconnects only while it has the focus, so the parent reloads it with each new link.
  useEffect(() => {
    if (drawn === null || round === 0) {
      state.value = drawn === null ? "none" : "loading";
      return undefined;
    }
    state.value = "loading";
    link.open();
    const { clientWidth: width = 0, clientHeight: height = 0 } = frame.current ?? {};
    frame.current?.contentWindow?.location.replace(
      viewUrl({ key: link.key, uid, theme: look, quality: drawn, width, height }),
    );
    const late = setTimeout(() => {
      if (state.peek() === "loading") state.value = "none";
    }, OPENING_MS);
    return () => clearTimeout(late);
  }, [look, round, drawn]);

  useEffect(() => {
    if (drawn === null) return;
    link.send({
      select: uid,
      theme: look,
      quality: drawn,
      visible: seen.value,
      wall: wall ?? null,
      poses: poses ?? null,
      resets: resets ?? 0,
      alone: alone ?? false,
    });
  });
  useEffect(() => () => link.close(), [link]);

  const shown = state.value === "shown";
  useEffect(() => {
    const inside = frame.current?.contentWindow;
    return shown && inside ? measure(inside) : undefined;
  }, [shown, drawn]);

  const onLoad = () => {
    const found = inspect(frame.current);
    if (found === "blank") return;
    state.value = found;
    // Key presses inside the frame do not reach this page, so Stop needs its own listener there.
    const inside = frame.current?.contentWindow;
    if (found === "shown" && inside) listen(inside, pressStop);
  };

  if (drawn === null) return null;
  return (
    <iframe
      ref={frame}
      title={title}
      onLoad={onLoad}
      hidden={!shown}
      class={still ? "still" : ""}
      {...(still ? { tabIndex: -1, "aria-hidden": true } : {})}
    />
  );
}

/** Whether the loaded document is the view, not an error page or this page; an error page may not be readable. */
function inspect(frame: HTMLIFrameElement | null): "blank" | "shown" | "none" {
  try {
    if (!frame?.contentWindow || frame.contentWindow.location.href === "about:blank") return "blank";
    return frame.contentDocument?.getElementById("root") ? "shown" : "none";
  } catch {
    return "none";
  }
}
