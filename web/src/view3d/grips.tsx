/**
 * Draggable parts of a 3D picture: the horn, while the jog pad's dial can be dragged, too, and the ends of the limit
 * arc, which stage edits. The camera is the server's; a drag continues where the camera moves under it.
 */
import { type ReadonlySignal, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { catalog } from "../bench/catalog";
import { peekServo } from "../bench/fleet";
import { angle as angleText } from "../bench/format";
import { readOnly } from "../bench/model";
import { dragSpan, dragTo, leaseHeader, motion, setpoint } from "../bench/motion";
import { sheetOf } from "../bench/parameters";
import { spanOf } from "../bench/row-state";
import { type Limits, limitsOf } from "../bench/servo-condition";
import type { Sight, Stand } from "../bench/view-link";
import { draftFor } from "../change/stage";
import { draggedTo } from "../kit/polar";
import { onDisc, pictured, pointedAngle, tooFlat } from "./sight";
import type { Size } from "./wall-projection";
import { sceneWords as words } from "./words";

type Grip = "horn" | "ccw" | "cw";
const ROWS = { cw: "angle_limit_cw", ccw: "angle_limit_ccw" } as const;
const RIM = 1.22;
const NOTICE_MS = 6000;

interface Drag {
  grip: Grip;
  /** Last commanded angle, and its offset from the pointer. */
  at: number;
  beside: number;
  sight: Sight;
  /** The motion session it started in; a drag does not continue in another one. */
  lease: string | undefined;
}

interface Props {
  uid: string;
  angle: number | null;
  stand: Stand;
  sight: ReadonlySignal<Sight | null>;
  size: Size;
}

export function Grips({ uid, angle, stand, sight, size }: Props) {
  const picture = useRef<SVGSVGElement>(null);
  const drag = useRef<Drag | null>(null);
  const notice = useSignal<string | null>(null);
  const seen = sight.value;
  const held = limitsOf(uid);
  const wanted = { ccw: drafted(uid, "ccw") ?? held?.ccw, cw: drafted(uid, "cw") ?? held?.cw };
  const live = dragSpan.value?.uid === uid;
  const horn = (live ? setpoint.value : null) ?? angle;

  useEffect(() => {
    if (notice.value === null) return undefined;
    const late = setTimeout(() => {
      notice.value = null;
    }, NOTICE_MS);
    return () => clearTimeout(late);
  }, [notice.value]);
  if (!seen || tooFlat(seen)) return null;

  const pointed = (event: PointerEvent) => {
    const box = picture.current?.getBoundingClientRect();
    const now = sight.peek();
    if (!box || !now) return null;
    return pointedAngle({ x: event.clientX - box.left, y: event.clientY - box.top }, now, size, stand);
  };
  const begin = (grip: Grip, at: number | null | undefined) => (event: PointerEvent) => {
    if (event.button !== 0) return;
    event.preventDefault();
    const why = grip === "horn" ? whyNot(uid) : whyNoDraft(uid, grip);
    notice.value = why;
    const there = pointed(event);
    if (why !== null || there === null || at === null || at === undefined || !seen) return;
    drag.current = { grip, at, beside: at - there, sight: seen, lease: leaseHeader().Lease };
    (event.currentTarget as Element).setPointerCapture(event.pointerId);
  };
  const follow = (event: PointerEvent) => {
    const going = drag.current;
    const there = pointed(event);
    if (!going || there === null) return;
    const now = sight.peek();
    if (now && now !== going.sight) {
      going.sight = now;
      going.beside = going.at - there;
      return;
    }
    if (going.grip === "horn") {
      const span = dragSpan.peek();
      if (span?.uid !== uid || leaseHeader().Lease !== going.lease) {
        drag.current = null;
        notice.value = whyNot(uid);
        return;
      }
      const next = draggedTo(there + going.beside, going.at, span.limits);
      if (next === null) return;
      going.at = next;
      dragTo(next);
      return;
    }
    const next = draggedTo(there + going.beside, going.at, boundsOf(uid, going.grip));
    if (next !== null && stage(uid, going.grip, next)) going.at = next;
  };
  const end = () => {
    const going = drag.current;
    drag.current = null;
    if (!going || going.grip === "horn") return;
    sheetOf(uid).drafts.commit(ROWS[going.grip], sheetOf(uid).held(ROWS[going.grip]));
  };

  const place = (at: number | null | undefined, reaches: number) =>
    at === null || at === undefined ? null : pictured(onDisc(stand, at, reaches), seen, size);
  const both = wanted.cw !== undefined && wanted.ccw !== undefined;
  const meet = both && Math.abs((((wanted.cw ?? 0) - (wanted.ccw ?? 0)) % 360) - 0) < 8;
  const spots = [
    { grip: "ccw" as const, at: wanted.ccw, spot: place(wanted.ccw, RIM) },
    { grip: "cw" as const, at: wanted.cw, spot: place(wanted.cw, meet ? RIM + 0.2 : RIM) },
    { grip: "horn" as const, at: horn, spot: place(horn, 0.9) },
  ];
  const changed = both && held !== null && (wanted.cw !== held.cw || wanted.ccw !== held.ccw);
  return (
    <>
      <svg ref={picture} class="grips" aria-hidden="true">
        {changed && <path class="wanted" d={arcOf(wanted as Limits, stand, seen, size)} />}
        {spots.map(
          ({ grip, at, spot }) =>
            spot && (
              <g
                key={grip}
                class={`grip ${grip}`}
                data-testid={`grip-${grip}`}
                data-angle={at}
                data-live={grip !== "horn" || live}
                transform={`translate(${spot.x.toFixed(1)} ${spot.y.toFixed(1)})`}
                onPointerDown={begin(grip, at)}
                onPointerMove={follow}
                onPointerUp={end}
                onPointerCancel={end}
                onLostPointerCapture={end}
              >
                <title>{grip === "horn" ? (whyNot(uid) ?? words.grip.horn) : words.grip[grip]}</title>
                <circle class="reach" r={grip === "horn" ? 18 : 14} />
                {(grip !== "horn" || live) && <circle class="mark" r={grip === "horn" ? 9 : 6} />}
              </g>
            ),
        )}
      </svg>
      {(notice.value !== null || changed) && (
        <p class="chip view-notice" role="status" data-testid="view-notice">
          {notice.value ?? words.grip.staged(angleText(wanted.ccw ?? null), angleText(wanted.cw ?? null))}
        </p>
      )}
    </>
  );
}

/** Why dragging the horn would move nothing; null if it moves. */
function whyNot(uid: string): string | null {
  const present = motion.value;
  if (present.phase !== "on" || present.uid !== uid) return words.grip.off;
  return dragSpan.value?.uid === uid ? null : words.grip.notNow;
}

function whyNoDraft(uid: string, grip: "cw" | "ccw"): string | null {
  const sheet = sheetOf(uid);
  const row = catalog.peek()?.rows.get(ROWS[grip]);
  if (!row || readOnly(peekServo(uid)) || sheet.busy.peek() !== null) return words.grip.noDraft;
  return null;
}

function drafted(uid: string, side: "cw" | "ccw"): number | null {
  const verdict = sheetOf(uid).drafts.get(ROWS[side])?.verdict;
  return verdict?.ok && typeof verdict.value === "number" ? verdict.value : null;
}

/** Range of a dragged limit: its row's range, and not beyond the other limit. */
function boundsOf(uid: string, grip: "cw" | "ccw"): Limits {
  const sheet = sheetOf(uid);
  const row = catalog.peek()?.rows.get(ROWS[grip]);
  const span = row && spanOf(row, sheet.reading(ROWS[grip]).peek());
  const [low, high] = [span?.minimum ?? -180, span?.maximum ?? 180];
  const held = limitsOf(uid);
  if (grip === "cw") return { ccw: Math.max(low, drafted(uid, "ccw") ?? held?.ccw ?? low), cw: high };
  return { ccw: low, cw: Math.min(high, drafted(uid, "cw") ?? held?.cw ?? high) };
}

/** One drag is one undo step, completed by `commit`. */
function stage(uid: string, grip: "cw" | "ccw", value: number): boolean {
  const sheet = sheetOf(uid);
  const row = catalog.peek()?.rows.get(ROWS[grip]);
  const draft = row && draftFor(sheet, row, value);
  if (!draft || "why" in draft) return false;
  sheet.setOutcomes([[row.key, null]]);
  sheet.drafts.put(row.key, draft);
  return true;
}

function arcOf({ ccw, cw }: Limits, stand: Stand, sight: Sight, size: Size): string {
  const steps = Array.from({ length: 49 }, (_, step) => ccw + ((cw - ccw) * step) / 48);
  const points = steps.map(at => pictured(onDisc(stand, at, RIM), sight, size));
  return points
    .map((at, step) => (at ? `${step === 0 ? "M" : "L"}${at.x.toFixed(1)} ${at.y.toFixed(1)}` : ""))
    .join("");
}
