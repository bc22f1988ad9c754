import { describe, expect, it } from "vitest";
import { ARC, boxOf, fill, NEARER, PITCH, project, TALL } from "./wall-projection";

const size = { width: 1200, height: 800 };

describe("the wall's projection", () => {
  it("shows the middle of the scene in the middle of the picture, the back above and the right at the right", () => {
    const middle = project(0, 0, 0, size);
    expect(middle.x).toBeCloseTo(600);
    expect(middle.y).toBeCloseTo(400);
    expect(project(1, 0, 0, size).x).toBeGreaterThan(600);
    expect(project(0, 1, 0, size).y).toBeLessThan(400);
    expect(project(0, 0, 1, size).y).toBeLessThan(400);
  });

  it.each([1, 2, 7, 20, 64, 127])(
    "gives each of %i servos a box in the picture that no other's touches",
    count => {
      const wall = fill(count, size);
      expect(wall.columns * wall.rows).toBeGreaterThanOrEqual(count);
      const boxes = Array.from({ length: count }, (_, index) => boxOf(index, wall, size));
      for (const box of boxes) {
        expect(box.left).toBeGreaterThanOrEqual(0);
        expect(box.top).toBeGreaterThanOrEqual(0);
        expect(box.left + box.width).toBeLessThanOrEqual(size.width);
        expect(box.top + box.height).toBeLessThanOrEqual(size.height);
      }
      for (const [place, one] of boxes.entries()) {
        for (const other of boxes.slice(place + 1)) {
          const apart =
            one.left + one.width <= other.left + 0.01 ||
            other.left + other.width <= one.left + 0.01 ||
            one.top + one.height <= other.top + 0.01;
          expect(apart).toBe(true);
        }
      }
    },
  );

  it.each([
    [1, size],
    [6, { width: 1224, height: 640 }],
    [6, { width: 600, height: 900 }],
    [60, { width: 1224, height: 640 }],
  ])("shows whole every horn and limit arc of %i servos", (count, picture) => {
    const wall = fill(count, picture);
    for (let index = 0; index < count; index++) {
      const [row, column] = [Math.floor(index / wall.columns), index % wall.columns];
      const x = (column - (wall.columns - 1) / 2) * PITCH[0] * wall.scale;
      const y = (((wall.rows - 1) / 2 - row) * PITCH[1] - NEARER) * wall.scale;
      const box = boxOf(index, wall, picture);
      for (let turn = 0; turn < 2 * Math.PI; turn += 0.2) {
        const reach = ARC * wall.scale;
        const at = project(
          x + reach * Math.sin(turn),
          y + reach * Math.cos(turn),
          TALL * wall.scale,
          picture,
        );
        expect(at.x).toBeGreaterThanOrEqual(0);
        expect(at.x).toBeLessThanOrEqual(picture.width);
        expect(at.y).toBeGreaterThanOrEqual(box.top);
        expect(at.y).toBeLessThanOrEqual(picture.height);
      }
    }
  });

  it("uses more columns in a wide picture than in a high one", () => {
    expect(fill(20, { width: 1600, height: 500 }).columns).toBeGreaterThan(
      fill(20, { width: 500, height: 1600 }).columns,
    );
  });
});
