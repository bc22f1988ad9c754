/** A parameter row in a document: typing, staging, refusing, offering the way out. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Reading, Row } from "../api/types";
import { replaceAll } from "../state/fleet";
import { link } from "../state/link";
import { Sheet } from "../state/parameters";
import { ParameterRow } from "./row";

const UID = "c".repeat(32);
const base = {
  address: 0x3c,
  name: "0x3C",
  group: "limit",
  section: "4.33",
  description: "",
  advice: "",
  expert: false,
};
const torque = {
  ...base,
  key: "torque_limit_cw",
  label: "Torque limit CW",
  access: "rw",
  kind: "number",
  unit: "%",
  per_unit: 1,
  choices: [],
} as unknown as Row;
const mode = {
  ...torque,
  key: "torque_mode",
  label: "Torque",
  kind: "choice",
  unit: "",
  choices: [
    { key: "on", label: "On", raw: 0 },
    { key: "off", label: "Off", raw: 1 },
  ],
} as unknown as Row;

const reading = (more: Partial<Reading>): Reading => ({
  key: "torque_limit_cw",
  address: 0x3c,
  value: 100,
  raw: 100,
  unit: "%",
  at: 0,
  age_s: 0,
  rom: 100,
  default: 100,
  minimum: 0,
  maximum: 100,
  in_effect: true,
  why_not: null,
  stale: false,
  ...more,
});

let host: HTMLElement;
let sheet: Sheet;

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  link.value = { state: "up", since: 0 };
  replaceAll([{ uid: UID, online: true, state: "ready", unsaved: [], age_s: 0 } as never]);
  sheet = new Sheet(UID);
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
});

const show = (row: Row, onGoTo = vi.fn()) =>
  act(() =>
    render(<ParameterRow sheet={sheet} row={row} onGoTo={onGoTo} onRetry={vi.fn()} locked={false} />, host),
  );
const find = <T extends HTMLElement>(id: string) => host.querySelector<T>(`[data-testid="${id}"]`);
const state = (key: string) => find(`row-${key}`)?.dataset.state;

function type(text: string): void {
  const box = find<HTMLInputElement>("input-torque_limit_cw");
  if (!box) throw new Error("no box");
  act(() => {
    box.value = text;
    box.dispatchEvent(new Event("input", { bubbles: true }));
  });
}

describe("ParameterRow", () => {
  test("shows what RAM, ROM and the tables hold", () => {
    sheet.put(reading({ rom: 80 }));
    show(torque);
    expect(state("torque_limit_cw")).toBe("idle");
    expect(find<HTMLInputElement>("input-torque_limit_cw")?.value).toBe("100");
    expect(host.querySelector(".p-rom")?.textContent).toContain("80");
    expect(host.querySelector(".p-rom")?.classList).toContain("strong");
  });

  test("above the range: said, not staged, and the nearest value is one press away", () => {
    sheet.put(reading({ value: 40, raw: 40 }));
    show(torque);
    type("120");
    expect(state("torque_limit_cw")).toBe("out_of_range");
    expect(find("message-torque_limit_cw")?.textContent).toContain(
      "is above the 100\u202f% this model allows.",
    );
    act(() => find("use-torque_limit_cw")?.click());
    expect(state("torque_limit_cw")).toBe("staged");
    expect(sheet.drafts.map.value.get("torque_limit_cw")?.verdict).toEqual({ ok: true, value: 100 });
  });

  test("a sign alone is not scolded while it is being typed", () => {
    sheet.put(reading({}));
    show(torque);
    type("-");
    expect(find("message-torque_limit_cw")).toBeNull();
    act(() => {
      find("input-torque_limit_cw")?.dispatchEvent(new Event("blur"));
    });
    expect(find("message-torque_limit_cw")).not.toBeNull();
  });

  test("back to what RAM holds is no change", () => {
    sheet.put(reading({}));
    show(torque);
    type("90");
    expect(state("torque_limit_cw")).toBe("staged");
    type("100");
    expect(state("torque_limit_cw")).toBe("idle");
  });

  test("a choice is a group of radio buttons", () => {
    sheet.put(reading({ key: "torque_mode", value: "on", raw: 0, unit: "", rom: "on", default: "on" }));
    show(mode);
    const off = find<HTMLInputElement>("input-torque_mode-off");
    expect(off?.type).toBe("radio");
    act(() => off?.click());
    expect(state("torque_mode")).toBe("staged");
    expect(sheet.drafts.map.value.get("torque_mode")?.verdict).toEqual({ ok: true, value: "off" });
  });

  test("no effect leads to the switch that is to blame", () => {
    sheet.put(
      reading({ in_effect: false, why_not: "No effect now: speed and torque control (0x25) is off." }),
    );
    const goTo = vi.fn();
    show(torque, goTo);
    expect(state("torque_limit_cw")).toBe("no_effect");
    act(() => host.querySelector<HTMLButtonElement>(".p-name .link")?.click());
    expect(goTo).toHaveBeenCalledWith("0x25");
  });

  test("nothing can be typed before the row was read, nor while a write is under way", () => {
    show(torque);
    expect(find<HTMLInputElement>("input-torque_limit_cw")?.disabled).toBe(true);
    act(() => sheet.put(reading({})));
    expect(find<HTMLInputElement>("input-torque_limit_cw")?.disabled).toBe(false);
    act(() => {
      sheet.busy.value = "applying";
    });
    expect(find<HTMLInputElement>("input-torque_limit_cw")?.disabled).toBe(true);
  });
});
