/** Dial geometry: 0° up, plus clockwise, as seen from the name plate. */

export interface Point {
  x: number;
  y: number;
}

export function polar(radius: number, degrees: number): Point {
  const at = (degrees * Math.PI) / 180;
  return { x: radius * Math.sin(at), y: -radius * Math.cos(at) };
}

/** The angle of a point, −180 to 180. */
export function angleAt(x: number, y: number): number {
  return (Math.atan2(x, -y) * 180) / Math.PI;
}

/** An arc from one angle clockwise to another; a full circle from 360° on. */
export function arc(radius: number, from: number, to: number): string {
  if (to - from >= 359.9) {
    return `M0 ${-radius}A${radius} ${radius} 0 1 1 0 ${radius}A${radius} ${radius} 0 1 1 0 ${-radius}`;
  }
  const a = polar(radius, from);
  const b = polar(radius, to);
  const large = to - from > 180 ? 1 : 0;
  return `M${round(a.x)} ${round(a.y)}A${radius} ${radius} 0 ${large} 1 ${round(b.x)} ${round(b.y)}`;
}

/** The horn: a hub of one radius tapering to a tip of another, pointing up. */
export function hornPath(hub: number, tip: number, length: number): string {
  return `M${-hub} 0A${hub} ${hub} 0 1 0 ${hub} 0L${tip} ${-length}A${tip} ${tip} 0 0 0 ${-tip} ${-length}Z`;
}

/** Tick marks every `step` degrees between two radii, as one path. */
export function ticks(inner: number, outer: number, step: number, skip = 0): string {
  let path = "";
  for (let degrees = 0; degrees < 360; degrees += step) {
    if (skip !== 0 && degrees % skip === 0) continue;
    const a = polar(inner, degrees);
    const b = polar(outer, degrees);
    path += `M${round(a.x)} ${round(a.y)}L${round(b.x)} ${round(b.y)}`;
  }
  return path;
}

/** Whole turns beyond ±180°, signed: 270° is one turn. */
export function wholeTurns(degrees: number): number {
  const whole = Math.round(degrees / 360);
  return whole === 0 ? 0 : whole;
}

/** `angle` shifted by whole turns to be nearest to `near`, so that a drag continues past ±180°. */
export function unwrap(angle: number, near: number): number {
  return angle + 360 * Math.round((near - angle) / 360);
}

/**
 * Angle requested by a drag, in tenths and within the limits; null if unchanged. A drag across the far side of a short
 * arc stops at its end instead of jumping to the other.
 */
export function draggedTo(pointed: number, from: number, limits: { ccw: number; cw: number }): number | null {
  const inside = Math.min(limits.cw, Math.max(limits.ccw, unwrap(pointed, from)));
  const next = Math.round(inside * 10) / 10;
  return next === from || Math.abs(next - from) > 120 ? null : next;
}

function round(value: number): number {
  return Math.round(value * 100) / 100;
}
