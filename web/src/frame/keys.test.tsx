/** The stop keys: when Esc and Space stop, what Esc does otherwise; and the page's own keys. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Job, LeaseView, Servo, Stop } from "../api/types";
import { setLeases, stop } from "../bench/bench";
import { monotonic } from "../bench/clock";
import { replaceAll } from "../bench/fleet";
import { jobs, setJob } from "../bench/jobs";
import { escapeArmed, listen, onKey, type StopKey } from "../bench/keys";
import { link } from "../bench/link";
import { type Motion, motion } from "../bench/motion";
import { released } from "../bench/release";
import { lastUid, parse, pathOf } from "../bench/route";
import { NumberBox } from "../change/number-box";
import { Dialog } from "../kit/dialog";
import { Search } from "../kit/search";
import { Nickname } from "../servos/nickname";
import { telemetry } from "../telemetry/store";

const UID = "d".repeat(32);
const ON: Motion = { phase: "on", uid: UID, lease: "L", torque: "on", others: [] };

let stops: StopKey[];
let forget: () => void;
let clock = 1e6;
let host: HTMLElement;

beforeEach(() => {
  stops = [];
  clock += 60_000;
  vi.spyOn(performance, "now").mockImplementation(() => clock);
  document.body.innerHTML = `
    <p id="text" tabindex="0">x</p><input id="box" type="text"><input id="tick" type="checkbox">
    <button id="button">b</button><select id="list"></select><textarea id="area"></textarea>
    <button role="switch" id="switch"><span id="inside"></span></button><main tabindex="-1"></main>
    <div id="host"></div>`;
  host = document.getElementById("host") as HTMLElement;
  link.value = { state: "up", since: 0 };
  atRest();
  forget = listen(window, key => stops.push(key));
});

afterEach(() => {
  act(() => render(null, host));
  forget();
  atRest();
});

/** Nothing moves and nothing is commanded. */
function atRest(): void {
  motion.value = { phase: "off", why: null };
  setLeases([]);
  stop.value = null;
  released.value = new Map();
  jobs.value = new Map();
  telemetry.clear();
  replaceAll([
    { uid: UID, state: "ready", online: true, age_s: 0, faults: {}, unsaved: [] } as unknown as Servo,
  ]);
}

interface Press extends KeyboardEventInit {
  /** Handled so much later than pressed, ms. */
  late?: number;
}

function pressOn(target: Element | null, key: string, { late = 0, ...more }: Press = {}): KeyboardEvent {
  const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...more });
  Object.defineProperty(event, "timeStamp", { value: clock - late });
  act(() => {
    target?.dispatchEvent(event);
  });
  return event;
}

const press = (id: string, key: string, more: Press = {}) => pressOn(document.getElementById(id), key, more);

function put<T>(signal: { value: T }, value: T): void {
  signal.value = value;
}

/** The angles of the last half second, degrees. */
function turned(...angles: number[]): void {
  const at = monotonic();
  const t = angles.map((_, place) => at - 0.1 * (angles.length - 1 - place));
  telemetry.push(UID, "current_angle", t, angles, at);
}

const state = (state: Servo["state"]) =>
  replaceAll([{ uid: UID, state, online: true, age_s: 0, faults: {}, unsaved: [] } as unknown as Servo]);

const MOVING: readonly (readonly [string, () => void])[] = [
  ["motion is on here", () => put(motion, ON)],
  ["motion is being turned on", () => put(motion, { phase: "requesting", uid: UID })],
  [
    "another client has motion control",
    () => setLeases([{ holder: "Rig 3", uids: null, expires_in_s: 2, request: null } as LeaseView]),
  ],
  ["a horn turns", () => turned(0, 1, 2, 3, 4)],
  ["a servo saves", () => state("saving")],
  ["a servo restarts", () => state("restarting")],
  ["a servo is in its soft start", () => state("soft_start")],
  ["a job runs", () => setJob({ id: "j", state: "running" } as Job)],
  ["torque off is not confirmed", () => put(released, new Map([[UID, "requesting"]]))],
  [
    "a stop is not confirmed",
    () => put(stop, { latched: true, servos: [{ uid: UID, confirmed: false }] } as unknown as Stop),
  ],
  ["nothing is known, for there is no link", () => put(link, { state: "down", since: 0 })],
];

describe("Esc while something moves or may move", () => {
  test.each(MOVING)("stops at the first press: %s", (_, begin) => {
    begin();
    expect(press("text", "Escape").defaultPrevented).toBe(true);
    expect(stops).toEqual(["Esc"]);
  });

  test.each(["text", "box", "tick", "button", "list", "area", "switch"])("stops from #%s", id => {
    motion.value = ON;
    press(id, "Escape");
    expect(stops).toEqual(["Esc"]);
  });

  test("a key held down stops once", () => {
    motion.value = ON;
    press("text", "Escape");
    press("text", "Escape", { repeat: true });
    expect(stops).toEqual(["Esc"]);
  });

  test("closes the newest dialog without acting, too", () => {
    motion.value = ON;
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

describe("Esc while nothing moves", () => {
  test("does not stop; a second one within a second does", () => {
    press("text", "Escape");
    expect(stops).toEqual([]);
    expect(escapeArmed.value).toBe(true);
    clock += 990;
    press("text", "Escape");
    expect(stops).toEqual(["Esc"]);
  });

  test("does not stop; a second one within a second does, however late a slow page handles it", () => {
    press("text", "Escape");
    clock += 4000;
    press("text", "Escape", { late: 3010 });
    expect(stops).toEqual(["Esc"]);
  });

  test("two that are further apart stop nothing, and neither does one held down", () => {
    press("text", "Escape");
    clock += 500;
    press("text", "Escape", { repeat: true });
    clock += 510;
    press("text", "Escape");
    expect(stops).toEqual([]);
  });

  test.each<[string, () => void]>([
    [
      "a lease that has run out",
      () => setLeases([{ holder: "x", uids: null, expires_in_s: -1 } as LeaseView]),
    ],
    ["a horn that hunts in its place", () => turned(0, 1.3, -1.3, 0.3)],
    [
      "a jump that is long past",
      () => {
        turned(0, 90);
        clock += 2000;
        turned(90, 90.1);
      },
    ],
    ["motion control held with torque off", () => put(motion, { phase: "off", why: "x" })],
    ["a job that has ended", () => setJob({ id: "j", state: "succeeded" } as Job)],
    ["torque off that was confirmed", () => put(released, new Map([[UID, "off"]]))],
    [
      "a confirmed stop",
      () => put(stop, { latched: true, servos: [{ uid: UID, confirmed: true }] } as unknown as Stop),
    ],
  ])("%s is nothing that moves", (_, begin) => {
    begin();
    press("text", "Escape");
    expect(stops).toEqual([]);
  });

  test("closes the newest dialog, and the second press stops though it closes one more", () => {
    const closed: string[] = [];
    const one = (name: string) =>
      act(() =>
        render(
          <Dialog title={name} foot={null} onClose={() => closed.push(name)}>
            <button type="button" id="in-dialog">
              x
            </button>
          </Dialog>,
          host,
        ),
      );
    one("first");
    press("in-dialog", "Escape");
    expect([closed, stops]).toEqual([["first"], []]);
    press("in-dialog", "Escape");
    expect(stops).toEqual(["Esc"]);
  });

  test("leaves a search, and the dialog behind what was closed stays open", () => {
    const close = vi.fn();
    const end = onKey("Escape", close);
    const typed = { value: "abc" };
    act(() => render(<Search label="Search" at={typed} />, host));
    const box = host.querySelector("input");
    box?.focus();
    pressOn(box, "Escape");
    expect(typed.value).toBe("");
    expect(document.activeElement?.tagName).toBe("MAIN");
    expect(stops).toEqual([]);
    expect(close).not.toHaveBeenCalled();
    end();
  });

  test("takes back what was typed into a number box; one with nothing typed leaves Esc to the dialog", () => {
    const close = vi.fn();
    const end = onKey("Escape", close);
    const reverted = vi.fn();
    const box = (typed: boolean) =>
      act(() =>
        render(
          <NumberBox
            id="number"
            row="gain"
            span={{ unit: "", perUnit: 1, minimum: 0, maximum: 99 }}
            held={5}
            draft={typed ? { text: "7", verdict: { ok: true, value: 7 } } : undefined}
            locked={false}
            describedBy=""
            onDraft={() => undefined}
            onCommit={() => undefined}
            onRevert={reverted}
            onBeginning={() => undefined}
          />,
          host,
        ),
      );
    box(true);
    press("number", "Escape");
    expect(reverted).toHaveBeenCalledOnce();
    expect(close).not.toHaveBeenCalled();
    box(false);
    clock += 2000;
    press("number", "Escape");
    expect(close).toHaveBeenCalledOnce();
    expect(stops).toEqual([]);
    end();
  });
});

describe("Space", () => {
  test("stops while motion is on, and does not scroll", () => {
    motion.value = ON;
    expect(press("text", " ").defaultPrevented).toBe(true);
    expect(stops).toEqual(["Space"]);
  });

  test.each(MOVING.filter(([what]) => !what.startsWith("motion")))(
    "is left to the page while %s",
    (_, begin) => {
      begin();
      expect(press("text", " ").defaultPrevented).toBe(false);
      expect(stops).toEqual([]);
    },
  );

  test.each(["box", "tick", "button", "list", "area", "switch", "inside"])("is left to #%s", id => {
    motion.value = ON;
    expect(press(id, " ").defaultPrevented).toBe(false);
    expect(stops).toEqual([]);
  });
});

describe("while an input method composes", () => {
  /** A word in the making: what a browser dispatches, in its order. The last key of Safari comes after the end. */
  function compose(box: Element | null, key: string): void {
    box?.dispatchEvent(new CompositionEvent("compositionstart", { bubbles: true, data: "" }));
    pressOn(box, "k", { isComposing: true });
    box?.dispatchEvent(new CompositionEvent("compositionupdate", { bubbles: true, data: "か" }));
    pressOn(box, key, { isComposing: true });
    box?.dispatchEvent(new CompositionEvent("compositionend", { bubbles: true, data: "" }));
    const last = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
    Object.defineProperty(last, "keyCode", { value: 229 });
    act(() => {
      box?.dispatchEvent(last);
    });
  }

  test.each(["at rest", "with motion on"])(
    "Esc neither stops, %s, nor closes nor counts as the first of two",
    how => {
      if (how !== "at rest") motion.value = ON;
      const close = vi.fn();
      const end = onKey("Escape", close);
      compose(document.getElementById("box"), "Escape");
      expect(stops).toEqual([]);
      expect(close).not.toHaveBeenCalled();
      motion.value = { phase: "off", why: null };
      press("box", "Escape");
      expect(stops).toEqual([]);
      expect(close).toHaveBeenCalledOnce();
      end();
    },
  );

  test("Esc and Enter leave a nickname as it is being written", () => {
    const sent = vi.fn();
    vi.stubGlobal("fetch", sent);
    act(() => render(<Nickname uid={UID} label="Tail" name="Tail" />, host));
    act(() => host.querySelector("button")?.click());
    const box = () => host.querySelector("input");
    for (const key of ["Enter", "Escape"]) {
      if (box()) (box() as HTMLInputElement).value = "かぜ";
      compose(box(), key);
      expect(box()?.value, key).toBe("かぜ");
    }
    expect(sent).not.toHaveBeenCalled();
    pressOn(box(), "Enter");
    expect(sent).toHaveBeenCalledOnce();
    vi.unstubAllGlobals();
  });

  test("no handler on the page sees the key, whichever it is", () => {
    const seen = vi.fn();
    document.getElementById("box")?.addEventListener("keydown", seen);
    for (const key of ["Enter", "Escape", "ArrowDown", " "]) compose(document.getElementById("box"), key);
    expect(seen).not.toHaveBeenCalled();
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

describe("keys that act on the servo of the page", () => {
  const ours = ["w", "Ctrl+Enter", "Ctrl+S"];
  const acts = new Map<string, ReturnType<typeof vi.fn>>();
  let ends: (() => void)[];

  beforeEach(() => {
    for (const key of ours) acts.set(key, vi.fn());
    ends = ours.map(key => onKey(key, acts.get(key) ?? vi.fn()));
  });
  afterEach(() => {
    for (const end of ends) end();
  });

  const all = (id: string, more: KeyboardEventInit = {}) => {
    press(id, "w", more);
    press(id, "Enter", { ctrlKey: true, ...more });
    press(id, "s", { ctrlKey: true, ...more });
    return ours.filter(key => acts.get(key)?.mock.calls.length);
  };

  test("W outside text boxes; Ctrl+Enter and Ctrl+S in them, too", () => {
    expect(all("box")).toEqual(["Ctrl+Enter", "Ctrl+S"]);
    expect(all("text")).toEqual(ours);
  });

  test("W is W with Shift or Caps Lock, and no shortcut of the browser's", () => {
    press("text", "W");
    expect(acts.get("w")).toHaveBeenCalledOnce();
    press("text", "w", { ctrlKey: true });
    expect(acts.get("w")).toHaveBeenCalledOnce();
  });

  test("a key held down acts once", () => {
    expect(all("text", { repeat: true })).toEqual([]);
  });

  test("none of them acts behind a dialog", () => {
    document.body.insertAdjacentHTML("beforeend", '<div role="dialog" aria-modal="true"></div>');
    expect(all("text")).toEqual([]);
    expect(press("text", "s", { ctrlKey: true }).defaultPrevented).toBe(true);
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
