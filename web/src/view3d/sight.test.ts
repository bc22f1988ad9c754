/** Where things are in a 3D picture, and that a drag in it means the angle that is seen there. */
import { describe, expect, test } from "vitest";
import type { Sight, Stand } from "../bench/view-link";
import { draggedTo } from "../kit/polar";
import { nameAt, onDisc, pictured, pointedAngle, tooFlat } from "./sight";

const size = { width: 400, height: 250 };
const stand: Stand = {
  uid: "a",
  at: [0, 0, 0],
  low: [-1.86, -0.525, 0],
  high: [0.87, 0.525, 2.4],
  height: 2.19,
  reach: 1.355,
};
const sight: Sight = {
  eye: [3.3, -4.7, 4.15],
  right: [0.8184, 0.5746, 0],
  down: [0.237, -0.3375, -0.911],
  ahead: [-0.5235, 0.7456, -0.4124],
  fov: 0.733,
  servos: [stand],
};

describe("a 3D picture", () => {
  test.each([-170, -90, -35, 0, 12.5, 60, 90, 179])(
    "an angle of %s° is pointed at where it is drawn",
    angle => {
      const at = pictured(onDisc(stand, angle, 1.2), sight, size);
      expect(at && pointedAngle(at, sight, size, stand)).toBeCloseTo(angle, 0);
    },
  );

  test("nothing is pointed at on the hub, nor on a disc seen from the side", () => {
    const hub = pictured([0, 0, stand.height], sight, size);
    expect(hub && pointedAngle(hub, sight, size, stand)).toBeNull();
    const flat: Sight = { ...sight, right: [1, 0, 0], down: [0, 0, -1], ahead: [0, 1, 0] };
    expect(tooFlat(flat)).toBe(true);
    expect(pointedAngle({ x: 100, y: 200 }, flat, size, stand)).toBeNull();
  });

  test("a name is below the horn, whatever its angle", () => {
    const name = nameAt(stand, sight, size);
    for (let angle = -180; angle < 180; angle += 10) {
      const tip = pictured(onDisc(stand, angle, 1), sight, size);
      expect(tip?.y).toBeLessThanOrEqual((name?.y ?? 0) + 0.5);
    }
  });
});

test("a drag stays within its limits, and does not jump over the far side", () => {
  const limits = { ccw: -60, cw: 60 };
  expect(draggedTo(20.04, 0, limits)).toBe(20);
  expect(draggedTo(90, 50, limits)).toBe(60);
  expect(draggedTo(90, 60, limits)).toBeNull();
  expect(draggedTo(-170, 60, { ccw: -100, cw: 60 })).toBeNull();
  expect(draggedTo(-170, 175, { ccw: -400, cw: 400 })).toBe(190);
});
