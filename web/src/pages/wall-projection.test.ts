import { describe, expect, it } from "vitest";
import { boxOf, fill, project } from "./wall-projection";

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

  it("uses more columns in a wide picture than in a high one", () => {
    expect(fill(20, { width: 1600, height: 500 }).columns).toBeGreaterThan(
      fill(20, { width: 500, height: 1600 }).columns,
    );
  });
});
