/** The table of results: a slight swing of a settled horn is not shown as hunting. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { expect, test } from "vitest";
import type { RunOverlay, StepMetrics, StepRun } from "../api/lab-types";
import { Metrics } from "./metrics";

function run(
  id: number,
  hunting: StepMetrics["hunting"],
  hz: number,
  rms: number,
  settling_s: number | null,
): StepRun {
  const metrics = { sample_s: 0.004, settling_s, hunting, hunting_hz: hz, hunting_rms_deg: rms };
  const step = { direction: "there", from_deg: 0, to_deg: 10, t: [], angle_deg: [], metrics };
  return {
    id,
    uid: "0".repeat(32),
    at: id,
    set_up: {},
    parameters: {},
    warnings: [],
    steps: [step],
  } as unknown as StepRun;
}

function row(...runs: StepRun[]): string[] {
  const root = document.createElement("div");
  const overlay = { runs, differences: {}, comparable: true, not_comparable: null } as RunOverlay;
  act(() => render(<Metrics overlay={overlay} direction="there" />, root));
  const cells = [...(root.querySelector("[data-testid=metric-hunting]")?.querySelectorAll("td") ?? [])];
  const shown = cells.map(
    cell => `${cell.querySelector("svg") ? "! " : ""}${cell.textContent?.trim().replace("\u202f", " ")}`,
  );
  act(() => render(null, root));
  return shown;
}

test("hunting has a warning and a frequency, a slight swing neither", () => {
  const hunts = run(1, "hunting", 15, 0.85, null);
  const slight = run(2, "slight", 1, 0.07, 0.2);
  expect(row(hunts, slight)).toEqual(["! 15 Hz, ±1.2°", "slight, ±0.1°", "gone"]);
  expect(row(slight, hunts)).toEqual(["slight, ±0.1°", "! 15 Hz, ±1.2°", "new"]);
});

test("a slight swing of a horn that does not settle is hunting", () => {
  const unsettled = run(1, "slight", 3, 0.14, null);
  const settled = run(2, "slight", 3, 0.14, 0.2);
  expect(row(unsettled, settled)).toEqual(["! 3 Hz, ±0.2°", "slight, ±0.2°", "gone"]);
});
