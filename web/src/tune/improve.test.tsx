/** Improve while readings of the angle are late: it can be opened, waits for the angle, and keeps it. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Servo } from "../api/types";
import { monotonic, now } from "../bench/clock";
import { replaceAll, servo } from "../bench/fleet";
import { link } from "../bench/link";
import { motion } from "../bench/motion";
import { telemetry } from "../telemetry/store";
import { dialog } from "./dialogs";
import { ImproveDialog, ImprovePart } from "./improve";

const UID = "e".repeat(32);
const LATE_S = 0.6;
const root = document.createElement("div");
let plans: { from_deg: number; to_deg: number }[];

function reading(angle_deg: number, age_s: number): void {
  act(() => {
    replaceAll([
      {
        uid: UID,
        online: true,
        state: "ready",
        angle_deg,
        age_s,
        unsaved: [],
        uptime_s: 9,
      } as unknown as Servo,
    ]);
    now.value = monotonic();
  });
}

/** The Improve tab, or its dialog. */
function Shown() {
  const one = servo(UID);
  if (!one) return null;
  return dialog.value === "improve" ? <ImproveDialog one={one} /> : <ImprovePart one={one} />;
}

const found = (testid: string) => root.querySelector<HTMLButtonElement>(`[data-testid=${testid}]`);

beforeEach(() => {
  plans = [];
  link.value = { state: "up", since: 0 };
  motion.value = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };
  telemetry.clear();
  vi.stubGlobal("fetch", (url: string, init: RequestInit) => {
    if (url.endsWith("/improve/plan")) plans.push(JSON.parse(init.body as string).bounds);
    const plan = { steps: 4, step_deg: 10, changes: ["angle_p_gain"] };
    return Promise.resolve(new Response(JSON.stringify(url.endsWith("/improve/plan") ? plan : {})));
  });
  document.body.append(root);
});

afterEach(() => {
  act(() => render(null, root));
  root.remove();
  dialog.value = null;
  motion.value = { phase: "off", why: null };
  vi.unstubAllGlobals();
});

test("a press is not lost while a reading is late, and the dialog plans for one angle", async () => {
  reading(10, LATE_S);
  act(() => render(<Shown />, root));
  expect(found("improve-against"), "a note that comes and goes moves the button").toBeNull();
  act(() => found("improve-open")?.click());
  expect(root.textContent).toContain("The current angle is not known");
  expect(found("improve-go")?.disabled).toBe(true);
  expect(plans).toEqual([]);

  reading(12, 0.1);
  await vi.waitFor(() => expect(found("improve-go")?.disabled).toBe(false));
  reading(12.4, LATE_S);
  expect(found("improve-go")?.disabled, "a late reading takes nothing back").toBe(false);
  reading(12.8, 0.1);
  expect(plans).toMatchObject([{ from_deg: -3, to_deg: 27 }]);
});
