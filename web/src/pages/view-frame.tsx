/** Owns the 3D frame: supervised, reloaded after a lost link, covered while frozen, replaced by the dial without it. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { age, angle } from "../form/format";
import { nameOf, servo } from "../state/fleet";
import { limitsOf } from "../state/here";
import { listen } from "../state/keys";
import { connection, up } from "../state/link";
import { pressStop } from "../state/stop";
import { theme } from "../state/theme";
import { text } from "../text/en";
import { Dial } from "../ui/dial";
import { liveOf } from "./readouts";
import { drawable, viewUrl } from "./view-url";

/** Nothing moves on the picture without data: then it says so. */
const FROZEN_S = 1;
/** The view is large and a slow machine may take long; after this it is not coming. */
const OPENING_MS = 30_000;

export function ViewFrame({ uid }: { uid: string }) {
  const frame = useRef<HTMLIFrameElement>(null);
  const state = useSignal<"loading" | "shown" | "none">("loading");
  const quality = drawable();
  const one = servo(uid);
  const round = connection.value;
  const look = theme.value;
  const present = liveOf(uid, "current_angle");
  const limits = limitsOf(uid);

  // The client inside reconnects only while it has the focus, so the parent loads it anew with each new link.
  useEffect(() => {
    if (quality === null || round === 0) {
      state.value = quality === null ? "none" : "loading";
      return undefined;
    }
    state.value = "loading";
    frame.current?.contentWindow?.location.replace(viewUrl({ uid, theme: look, quality }));
    const late = setTimeout(() => {
      if (state.peek() === "loading") state.value = "none";
    }, OPENING_MS);
    return () => clearTimeout(late);
  }, [uid, look, round, quality]);

  const onLoad = () => {
    const found = inspect(frame.current);
    if (found === "blank") return;
    state.value = found;
    // Keys pressed inside do not come up here: Stop has to be listened for there too.
    const inside = frame.current?.contentWindow;
    if (found === "shown" && inside) listen(inside, pressStop);
  };

  const frozen = !up.value || one?.online !== true || present.age === null || present.age > FROZEN_S;
  return (
    <section
      class="view"
      data-testid="view-frame"
      data-state={state.value}
      data-frozen={frozen}
      aria-label={text.view.frame}
    >
      {quality !== null && (
        <iframe ref={frame} title={text.view.frame} onLoad={onLoad} hidden={state.value !== "shown"} />
      )}
      {state.value !== "shown" && (
        <div class="instead">
          <Dial
            size={200}
            angle={present.value ?? one?.angle_deg ?? null}
            command={one?.command_deg ?? null}
            limits={limits}
            stale={frozen}
            label={text.view.none}
          />
        </div>
      )}
      {frozen && (
        <div class="frozen">
          <span class="chip">
            {present.age === null ? text.view.noData : text.view.frozen(age(Math.max(present.age, FROZEN_S)))}
          </span>
        </div>
      )}
      <span class="chip top left">{nameOf(one)}</span>
      {!frozen && present.age !== null && (
        <span class="chip top right">{text.view.live(age(present.age))}</span>
      )}
      {limits && (
        <span class="chip bottom left">{text.view.limits(angle(limits.ccw), angle(limits.cw))}</span>
      )}
      {state.value === "none" && <span class="chip bottom right">{text.view.none}</span>}
      {state.value === "loading" && <span class="chip bottom right">{text.view.loading}</span>}
    </section>
  );
}

/** Whether what was loaded is the view, and not an error page or our own; an error page may not even be looked at. */
function inspect(frame: HTMLIFrameElement | null): "blank" | "shown" | "none" {
  try {
    if (!frame?.contentWindow || frame.contentWindow.location.href === "about:blank") return "blank";
    return frame.contentDocument?.getElementById("root") ? "shown" : "none";
  } catch {
    return "none";
  }
}
