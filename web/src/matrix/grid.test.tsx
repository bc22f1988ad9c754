/** The grid in a document: the arrow keys reach every cell and head, and a link leads to its row once. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Reading, Row } from "../api/types";
import { replaceAll } from "../bench/fleet";
import { link } from "../bench/link";
import { sheetOf } from "../bench/parameters";
import { MatrixGrid } from "./grid";

const UIDS = ["a".repeat(32), "b".repeat(32)];
const row = (key: string) =>
  ({
    key,
    name: "0x2C",
    label: key,
    kind: "number",
    unit: "",
    per_unit: 1,
    choices: [],
    access: "rw",
    identity: false,
    expert: false,
    section: "4.21",
    description: "",
  }) as unknown as Row;
const reading = (key: string): Reading =>
  ({
    key,
    value: 40,
    configured: 40,
    raw: 40,
    unit: "",
    age_s: 0,
    rom: 40,
    default: 40,
    minimum: 0,
    maximum: 99,
    stale: false,
    in_effect: true,
  }) as Reading;

let host: HTMLElement;

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  link.value = { state: "up", since: 0 };
  replaceAll(
    UIDS.map(
      uid =>
        ({
          uid,
          online: true,
          state: "ready",
          model: "M",
          treated_as: { model: null, firmware: null },
          output: { state: "on", reason: "configured", by: null, since: null },
          activity: {
            state: "holding",
            peak_to_peak_deg: null,
            oscillation_hz: null,
            torque_pct: null,
            torque_limit_pct: null,
          },
          unsaved: [],
          faults: {},
          age_s: 0,
        }) as never,
    ),
  );
  for (const uid of UIDS) sheetOf(uid).take("1", { gain: reading("gain"), boost: reading("boost") });
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
});

const show = (hash = "gain") =>
  act(() =>
    render(
      <MatrixGrid
        uids={UIDS}
        groups={[{ key: "control", label: "Control", rows: [row("gain"), row("boost")] }]}
        hash={hash}
        onSet={vi.fn()}
        onCopy={vi.fn()}
      >
        {null}
      </MatrixGrid>,
      host,
    ),
  );
const here = () => (document.activeElement as HTMLElement | null)?.dataset.testid;
const press = (key: string) =>
  act(() => {
    document.activeElement?.dispatchEvent(
      new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }),
    );
  });

test("a link leads to its row; arrow keys go on from there, to heads as well, and no redraw fetches them back", () => {
  show();
  expect(here()).toBe(`cell-${UIDS[0]}-gain`);
  press("ArrowRight");
  expect(here()).toBe(`cell-${UIDS[1]}-gain`);
  show();
  expect(here()).toBe(`cell-${UIDS[1]}-gain`);
  press("ArrowUp");
  expect(here()).toBe(`copy-${UIDS[1]}`);
  press("ArrowDown");
  expect(here()).toBe(`cell-${UIDS[1]}-gain`);
  press("ArrowDown");
  expect(here()).toBe(`cell-${UIDS[1]}-boost`);
  press("Home");
  expect(here()).toBe("set-boost");
});

test("one place of the grid is in the order of Tab: where the focus was last", () => {
  show();
  press("ArrowRight");
  const stops = [...host.querySelectorAll<HTMLElement>("[data-stop]")].filter(one => one.tabIndex === 0);
  expect(stops.map(one => one.dataset.testid)).toEqual([`cell-${UIDS[1]}-gain`]);
});

test("Enter opens the box of a cell, and Enter again keeps the value and gives the focus back", () => {
  show();
  press("Enter");
  const box = document.activeElement as HTMLInputElement;
  expect(box.tagName).toBe("INPUT");
  act(() => {
    box.value = "33";
    box.dispatchEvent(new Event("input", { bubbles: true }));
  });
  press("Enter");
  expect(here()).toBe(`cell-${UIDS[0]}-gain`);
  expect(sheetOf(UIDS[0] ?? "").drafts.get("gain")?.verdict).toEqual({ ok: true, value: 33 });
});
