/** Whether Stop is seen: the whole button, in what is seen of the page, with nothing over it. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { stopButton } from "../testing/stop-button";
import { stopInSight, stopSeen, within } from "./stop-sight";

const view = { left: 0, top: 0, right: 320, bottom: 568 };
let end: () => void = () => undefined;

/** What is seen of the page: `scale` times as large, from `left`, `top`. */
function pinch(width: number, height: number, left = 0, top = 0, scale = 1): void {
  const seen = {
    width,
    height,
    offsetLeft: left,
    offsetTop: top,
    scale,
    addEventListener() {},
    removeEventListener() {},
  };
  vi.stubGlobal("visualViewport", seen);
}

beforeEach(() => {
  pinch(320, 568);
  vi.spyOn(document, "elementFromPoint").mockReturnValue(null);
});

afterEach(() => {
  end();
  vi.unstubAllGlobals();
});

describe("within", () => {
  test.each([
    [{ left: 0, top: 0, right: 320, bottom: 72 }, true],
    [{ left: -0.4, top: 0, right: 320.4, bottom: 72 }, true],
    [{ left: 456, top: 0, right: 632, bottom: 72 }, false],
    [{ left: 144, top: -1, right: 320, bottom: 71 }, false],
    [{ left: 0, top: 500, right: 320, bottom: 572 }, false],
  ])("%j: %s", (box, expected) => {
    expect(within(box, view)).toBe(expected);
  });
});

describe("stopSeen", () => {
  test("a button inside the window is seen", () => {
    end = stopButton({ left: 0, top: 0, right: 320, bottom: 72 });
    expect(stopSeen()).toBe(true);
  });

  test("one past the window's edge is not, and neither is one of no size", () => {
    end = stopButton({ left: 456, top: 0, right: 632, bottom: 72 });
    expect(stopSeen()).toBe(false);
    expect(stopInSight.value).toBe(false);
    end();
    end = stopButton({ left: 0, top: 0, right: 0, bottom: 0 });
    expect(stopSeen()).toBe(false);
  });

  test("one that a keyboard or an enlarged page pushed out is not", () => {
    end = stopButton({ left: 0, top: 0, right: 320, bottom: 72 });
    pinch(320, 300, 0, 120);
    expect(stopSeen()).toBe(false);
  });

  test("one whose words are cut is not", () => {
    end = stopButton();
    pinch(1024, 768);
    expect(stopSeen()).toBe(true);
    vi.spyOn(HTMLElement.prototype, "scrollWidth", "get").mockReturnValue(300);
    expect(stopSeen()).toBe(false);
  });

  test("one with something over it is not", () => {
    end = stopButton();
    pinch(1024, 768);
    vi.spyOn(document, "elementFromPoint").mockReturnValue(document.body);
    expect(stopSeen()).toBe(false);
  });

  test("without a button there is nothing to see", () => {
    stopButton()();
    expect(stopSeen()).toBe(false);
  });
});

test("an enlarged page has Stop at the upper right of what is seen, at its own size", () => {
  pinch(512, 384, 100, 200, 2);
  end = stopButton();
  const button = document.querySelector("button") as HTMLElement;
  const right = 612 - document.documentElement.clientWidth;
  expect(button.style.transform).toBe(`translate(${right}px, 200px) scale(0.5)`);
});
