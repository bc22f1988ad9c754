/** Projection of a 3D scene into its picture, and of a pointer back into the scene. */
import type { Sight, Stand } from "../bench/view-link";
import { angleAt, type Point, polar } from "../kit/polar";
import type { Size } from "./wall-projection";

type Vector = readonly [number, number, number];

/** A disc flatter than this is seen so much from the side that a pixel spans many degrees. */
const FLAT = 0.22;

const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

const focal = (sight: Sight, size: Size) => size.height / 2 / Math.tan(sight.fov / 2);

/** A scene point in a picture of this size, px from its top left; null behind the camera. */
export function pictured(at: Vector, sight: Sight, size: Size): Point | null {
  const from: Vector = [at[0] - sight.eye[0], at[1] - sight.eye[1], at[2] - sight.eye[2]];
  const depth = dot(from, sight.ahead);
  if (depth < 0.1) return null;
  const by = focal(sight, size) / depth;
  return { x: size.width / 2 + by * dot(from, sight.right), y: size.height / 2 + by * dot(from, sight.down) };
}

/** Point of a servo's disc at an angle and a distance from its shaft, in horn lengths. */
export function onDisc(stand: Stand, angle: number, reaches: number): Vector {
  const { x, y } = polar(stand.reach * reaches, angle);
  return [stand.at[0] + x, stand.at[1] - y, stand.at[2] + stand.height];
}

/** Angle on the disc under a pointer, −180 to 180; null where it misses the disc or sees it too flat. */
export function pointedAngle(at: Point, sight: Sight, size: Size, stand: Stand): number | null {
  const by = focal(sight, size);
  const [across, down] = [(at.x - size.width / 2) / by, (at.y - size.height / 2) / by];
  const way = [0, 1, 2].map(
    axis => (sight.ahead[axis] ?? 0) + across * (sight.right[axis] ?? 0) + down * (sight.down[axis] ?? 0),
  ) as unknown as Vector;
  const away = (stand.at[2] + stand.height - sight.eye[2]) / way[2];
  if (tooFlat(sight) || !(away > 0)) return null;
  const [x, y] = [sight.eye[0] + away * way[0] - stand.at[0], sight.eye[1] + away * way[1] - stand.at[1]];
  // Closer to the shaft than the hub, a pixel spans too many degrees.
  return Math.hypot(x, y) < stand.reach * 0.2 ? null : angleAt(x, -y);
}

export const tooFlat = (sight: Sight) => sight.ahead[2] > -FLAT;

/** Position of a name: centred below case and horn at any horn angle. Null outside the picture. */
export function nameAt(stand: Stand, sight: Sight, size: Size): Point | null {
  const sides = [stand.low, stand.high];
  const box = [0, 1, 2, 3, 4, 5, 6, 7].map(
    corner =>
      [0, 1, 2].map(
        axis => (stand.at[axis] ?? 0) + (sides[(corner >> axis) & 1]?.[axis] ?? 0),
      ) as unknown as Vector,
  );
  const disc = Array.from({ length: 24 }, (_, step) => onDisc(stand, step * 15, 1));
  const points = [...box, ...disc].map(point => pictured(point, sight, size));
  if (points.some(point => point === null)) return null;
  const seen = points as Point[];
  const across = seen.slice(0, box.length).map(point => point.x);
  return {
    x: (Math.min(...across) + Math.max(...across)) / 2,
    y: Math.max(...seen.map(point => point.y)),
  };
}
