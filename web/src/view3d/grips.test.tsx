/** A drag in the 3D picture: it commands where the dial could, ends with that, and stages limits without a write. */
import { signal } from "@preact/signals";
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { live } from "../bench/link";
import { dragSpan, motion } from "../bench/motion";
import type { Sight, Stand } from "../bench/view-link";
import { Grips } from "./grips";
import { onDisc, pictured } from "./sight";

const uid = "a".repeat(32);
const size = { width: 400, height: 250 };
const stand: Stand = {
  uid,
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
const on = { phase: "on", uid, lease: "L", torque: "on", others: [] } as const;
let host: HTMLElement;
let sent: unknown[];

beforeEach(() => {
  sent = [];
  vi.useFakeTimers();
  vi.spyOn(live, "send").mockImplementation(message => {
    sent.push(message);
    return true;
  });
  Element.prototype.setPointerCapture ??= () => undefined;
  host = document.body.appendChild(document.createElement("div"));
  act(() => render(<Grips {...{ uid, stand, size }} angle={0} sight={signal(sight)} />, host));
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
  dragSpan.value = null;
  motion.value = { phase: "off", why: null };
  vi.useRealTimers();
  vi.restoreAllMocks();
});

function point(type: string, angle: number): void {
  const at = pictured(onDisc(stand, angle, 0.9), sight, size);
  const grip = host.querySelector("[data-testid=grip-horn]");
  const event = new MouseEvent(type, { bubbles: true, button: 0, clientX: at?.x ?? 0, clientY: at?.y ?? 0 });
  act(() => {
    grip?.dispatchEvent(event);
    vi.advanceTimersByTime(100);
  });
}

const commands = () => sent.filter(one => (one as { type: string }).type === "command");

test("without motion control a drag sends nothing and says why", () => {
  point("pointerdown", 0);
  point("pointermove", 20);
  expect(commands()).toEqual([]);
  expect(host.querySelector("[role=status]")?.textContent).toContain("Motion is off");
});

test("while motion is on and the dial may not be dragged, neither may the horn", () => {
  motion.value = on;
  point("pointerdown", 0);
  point("pointermove", 20);
  expect(commands()).toEqual([]);
});

test("where the dial may be dragged it commands under the lease and within the limits, until that ends", () => {
  motion.value = on;
  act(() => {
    dragSpan.value = { uid, limits: { ccw: -30, cw: 30 } };
  });
  point("pointerdown", 0);
  point("pointermove", 20);
  expect(commands()).toMatchObject([
    { lease: "L", commands: [{ uid, type: "angle", value: expect.closeTo(20, 0) }] },
  ]);
  point("pointermove", 80);
  expect(commands().at(-1)).toMatchObject({ commands: [{ value: 30 }] });
  const before = commands().length;
  // Another lease is another decision: the finger that is still down has made none.
  motion.value = { ...on, lease: "M" };
  point("pointermove", 0);
  expect(commands()).toHaveLength(before);
  motion.value = on;
  point("pointermove", 10);
  expect(commands()).toHaveLength(before);
});
