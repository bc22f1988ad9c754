/** The stop keys: Esc everywhere, Space where it means nothing else; and the page's own keys. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { listen, onKey, type StopKey } from "./keys";
import { lastUid, parse, pathOf } from "./route";

let stops: StopKey[];
let forget: () => void;

beforeEach(() => {
  stops = [];
  document.body.innerHTML = `
    <p id="text" tabindex="0">x</p><input id="box" type="text"><input id="tick" type="checkbox">
    <button id="button">b</button><select id="list"></select><textarea id="area"></textarea>
    <button role="switch" id="switch"><span id="inside"></span></button>`;
  forget = listen(window, key => stops.push(key));
});

afterEach(() => forget());

function press(id: string, key: string, more: KeyboardEventInit = {}): KeyboardEvent {
  const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...more });
  document.getElementById(id)?.dispatchEvent(event);
  return event;
}

describe("Stop", () => {
  test.each(["text", "box", "tick", "button", "list", "area", "switch"])("Esc stops from #%s", id => {
    press(id, "Escape");
    expect(stops).toEqual(["Esc"]);
  });

  test("Space stops, and does not scroll", () => {
    expect(press("text", " ").defaultPrevented).toBe(true);
    expect(stops).toEqual(["Space"]);
  });

  test.each(["box", "tick", "button", "list", "area", "switch", "inside"])("Space is left to #%s", id => {
    expect(press(id, " ").defaultPrevented).toBe(false);
    expect(stops).toEqual([]);
  });

  test("a key held down stops once", () => {
    press("text", "Escape");
    press("text", "Escape", { repeat: true });
    expect(stops).toEqual(["Esc"]);
  });

  test("Esc stops and closes the newest dialog without acting", () => {
    const close = vi.fn();
    const older = vi.fn();
    const ends = [onKey("Escape", older), onKey("Escape", close)];
    press("button", "Escape");
    expect(stops).toEqual(["Esc"]);
    expect(close).toHaveBeenCalledOnce();
    expect(older).not.toHaveBeenCalled();
    for (const end of ends) end();
  });
});

describe("other keys", () => {
  test("? opens help, but not while typing", () => {
    const help = vi.fn();
    const end = onKey("?", help);
    press("box", "?");
    expect(help).not.toHaveBeenCalled();
    press("text", "?");
    expect(help).toHaveBeenCalledOnce();
    end();
    press("text", "?");
    expect(help).toHaveBeenCalledOnce();
  });

  test("Ctrl+S is ours even in a box; Ctrl+Z in a box is the box's", () => {
    const diff = vi.fn();
    const undo = vi.fn();
    const ends = [onKey("Ctrl+S", diff), onKey("Ctrl+Z", undo)];
    expect(press("box", "s", { ctrlKey: true }).defaultPrevented).toBe(true);
    press("box", "z", { ctrlKey: true });
    press("text", "z", { ctrlKey: true });
    expect(diff).toHaveBeenCalledOnce();
    expect(undo).toHaveBeenCalledOnce();
    for (const end of ends) end();
  });
});

describe("g, then a letter", () => {
  const uid = `${"0".repeat(31)}a`;

  test.each([
    ["s", "/servos"],
    ["c", "/commission"],
    ["p", `/servos/${uid}/parameters`],
    ["m", `/servos/${uid}/motion`],
    ["t", `/servos/${uid}/tune`],
    ["f", "/faults"],
    ["b", "/bus"],
    ["r", "/records"],
    ["a", "/api-page"],
  ])("g %s goes to %s", (letter, path) => {
    lastUid.value = uid;
    press("text", "g");
    press("text", letter);
    expect(location.pathname).toBe(path);
    expect(pathOf(parse(path, "").page, parse(path, "").uid)).toBe(path);
  });

  test("goes nowhere while typing, nor without the g", () => {
    press("text", "g");
    press("text", "s");
    for (const key of ["g", "b"]) press("box", key);
    press("text", "b");
    expect(location.pathname).toBe("/servos");
  });
});
