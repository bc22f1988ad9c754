/** The typed angle: Enter leads to the button, and the button alone sends. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test } from "vitest";
import { link } from "../bench/link";
import { JogAngle } from "./jog-angle";

const UID = "a".repeat(32);
let sent: number[];
const root = document.createElement("div");

beforeEach(() => {
  sent = [];
  link.value = { state: "up", since: 0 };
  document.body.append(root);
  const span = { unit: "°", perUnit: 10, minimum: -60, maximum: 60 };
  act(() =>
    render(
      <JogAngle
        uid={UID}
        span={span}
        able
        present={12.3}
        onWrong={() => undefined}
        onJog={() => undefined}
        onCommand={value => sent.push(value)}
      />,
      root,
    ),
  );
});

afterEach(() => {
  act(() => render(null, root));
  root.remove();
});

const found = <T extends HTMLElement>(testid: string) =>
  root.querySelector<T>(`[data-testid=${testid}]`) as T;

test("Enter in the box sends nothing, and the button it leads to sends once", () => {
  const box = found<HTMLInputElement>("jog-value");
  act(() => {
    box.focus();
    box.value = "30";
    box.dispatchEvent(new InputEvent("input", { bubbles: true }));
  });
  const enter = new KeyboardEvent("keydown", { key: "Enter", bubbles: true, cancelable: true });
  act(() => {
    box.dispatchEvent(enter);
  });
  expect(sent).toEqual([]);
  expect(enter.defaultPrevented, "else the browser goes on with a click on the button").toBe(true);
  expect(document.activeElement).toBe(found("jog-go"));
  act(() => found("jog-go").click());
  expect(sent).toEqual([30]);
});

test("a held Enter is one press: its repeats are no clicks", () => {
  const repeat = new KeyboardEvent("keydown", {
    key: "Enter",
    repeat: true,
    bubbles: true,
    cancelable: true,
  });
  found("jog-zero").dispatchEvent(repeat);
  expect(repeat.defaultPrevented).toBe(true);
});
