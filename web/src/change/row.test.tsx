/** A parameter row in a document: typing, staging, refusing, offering the way out. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Reading, Row } from "../api/types";
import { catalog } from "../bench/catalog";
import { replaceAll } from "../bench/fleet";
import { link } from "../bench/link";
import { Sheet } from "../bench/parameters";
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
  configured: more.value === undefined ? 100 : more.value,
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
  why: null,
  stale: false,
  differs_from_default: false,
  unsaved: false,
  ...more,
});

let host: HTMLElement;
let sheet: Sheet;

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  link.value = { state: "up", since: 0 };
  const output = { state: "on", reason: "configured", by: null, since: null };
  replaceAll([{ uid: UID, online: true, state: "ready", output, unsaved: [], age_s: 0 } as never]);
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
      "is above this model's limit of 100\u202f%.",
    );
    act(() => find("use-torque_limit_cw")?.click());
    expect(state("torque_limit_cw")).toBe("staged");
    expect(sheet.drafts.map.value.get("torque_limit_cw")?.verdict).toEqual({ ok: true, value: 100 });
  });

  test("what became of a write is said until the row is edited again, however often it is shown", () => {
    sheet.put(reading({ value: 40, raw: 40 }));
    show(torque);
    type("50");
    act(() => sheet.setOutcomes([["torque_limit_cw", { kind: "failed", what: "Not written.", rest: "" }]]));
    for (const element of [null, torque]) {
      if (element === null) act(() => render(null, host));
      else show(element);
    }
    expect(find("message-torque_limit_cw")?.textContent).toContain("Not written.");
    expect(sheet.drafts.undo()).toBe("torque_limit_cw");
    expect(sheet.drafts.undo()).toBeNull();
  });

  test("a range that changes judges what was typed before, and that is no edit", () => {
    catalog.value = { revision: "", tabs: [], rows: new Map([[torque.key, torque]]), faults: [] };
    sheet.put(reading({ value: 40, raw: 40 }));
    show(torque);
    type("90");
    expect(state("torque_limit_cw")).toBe("staged");
    act(() => sheet.put(reading({ value: 40, raw: 40, maximum: 80 })));
    expect(state("torque_limit_cw")).toBe("out_of_range");
    sheet.drafts.undo();
    expect(sheet.drafts.map.value.size).toBe(0);
    catalog.value = null;
  });

  test("typing is left as it is typed, so that the caret stays where it is", () => {
    sheet.put(reading({ value: 40, raw: 40 }));
    show(torque);
    type("-40");
    expect(find<HTMLInputElement>("input-torque_limit_cw")?.value).toBe("-40");
  });

  test("a number that can be read in two ways offers both that are allowed", () => {
    sheet.put(reading({ value: 40, raw: 40, maximum: 2000 }));
    show({ ...torque, per_unit: 10 } as Row);
    type("1,500");
    expect(find("message-torque_limit_cw")?.textContent).toContain("Enter 1500 or 1.5.");
    const offers = () => [...host.querySelectorAll<HTMLElement>('[data-testid="use-torque_limit_cw"]')];
    expect(offers()).toHaveLength(2);
    act(() => offers()[1]?.click());
    expect(sheet.drafts.map.value.get("torque_limit_cw")?.verdict).toEqual({ ok: true, value: 1.5 });
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

  describe("the default", () => {
    const button = () => find<HTMLButtonElement>("default-torque_limit_cw");

    test("is staged by its button, and taken back by the same", () => {
      sheet.put(reading({ value: 80, raw: 80 }));
      show(torque);
      expect(button()?.getAttribute("aria-label")).toBe("Set Torque limit CW to its default, 100\u202f%");
      expect(button()?.getAttribute("aria-pressed")).toBe("false");
      act(() => button()?.click());
      expect(state("torque_limit_cw")).toBe("staged");
      expect(sheet.drafts.map.value.get("torque_limit_cw")?.verdict).toEqual({ ok: true, value: 100 });
      expect(find<HTMLInputElement>("input-torque_limit_cw")?.value).toBe("100");
      expect(button()?.getAttribute("aria-pressed")).toBe("true");
      act(() => button()?.click());
      expect(state("torque_limit_cw")).toBe("idle");
      expect(sheet.drafts.map.value.size).toBe(0);
    });

    test("replaces what was typed wrong", () => {
      sheet.put(reading({}));
      show(torque);
      expect(button()).toBeNull();
      type("120");
      act(() => button()?.click());
      expect(sheet.drafts.map.value.size).toBe(0);
      expect(state("torque_limit_cw")).toBe("idle");
    });

    test("of a choice is staged as well", () => {
      sheet.put(reading({ key: "torque_mode", value: "off", raw: 1, unit: "", rom: "off", default: "on" }));
      show(mode);
      act(() => find<HTMLButtonElement>("default-torque_mode")?.click());
      expect(sheet.drafts.map.value.get("torque_mode")?.verdict).toEqual({ ok: true, value: "on" });
    });

    test("cannot be pressed where the row holds it, is locked or only read", () => {
      sheet.put(reading({}));
      show(torque);
      expect(button()).toBeNull();
      act(() => sheet.put(reading({ value: 80, raw: 80 })));
      expect(button()).not.toBeNull();
      act(() =>
        render(
          <ParameterRow sheet={sheet} row={torque} onGoTo={vi.fn()} onRetry={vi.fn()} locked={true} />,
          host,
        ),
      );
      expect(button()).toBeNull();
      show({ ...torque, access: "r" } as Row);
      expect(button()).toBeNull();
    });

    test("is staged by a press on its mark; the pointer drags everywhere else", () => {
      sheet.put(reading({ value: 80, raw: 80 }));
      show(torque);
      const mark = host.querySelector(".ruler .standard rect");
      const down = new PointerEvent("pointerdown", { bubbles: true, button: 0, pointerType: "mouse" });
      act(() => {
        mark?.dispatchEvent(down);
      });
      expect(sheet.drafts.map.value.get("torque_limit_cw")?.verdict).toEqual({ ok: true, value: 100 });
    });
  });
});
