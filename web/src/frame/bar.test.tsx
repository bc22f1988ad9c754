/** Motion control in the top bar: whose it is, and of how many servos if it is not of all. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test } from "vitest";
import type { LeaseView } from "../api/types";
import { setLeases } from "../bench/bench";
import { monotonic, now } from "../bench/clock";
import { haveLease } from "../bench/holder";
import { link } from "../bench/link";
import { tightBar } from "../bench/screen";
import { TopBar } from "./bar";

const [A, B, C] = ["a", "b", "c"].map(one => one.repeat(32)) as [string, string, string];
let host: HTMLElement;

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  link.value = { state: "up", since: 0 };
  now.value = monotonic();
  haveLease("mine and secret");
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
  setLeases([]);
  tightBar.value = true;
});

const lease = (holder: string, uids: string[] | null, more: Partial<LeaseView> = {}): LeaseView => ({
  shown_id: holder,
  holder,
  uids,
  ttl_s: 3,
  expires_at: 0,
  expires_in_s: 1.5,
  request: null,
  ...more,
});
const request = { id: "r", by: "Bob", reason: "", expires_in_s: 8.5 };

test.each<[string, LeaseView[], string]>([
  ["none", [], "Motion controlFree"],
  ["of all", [lease("Rig A", null)], "Motion controlRig A, 2\u202fs left"],
  ["of some", [lease("Rig A", [A, B, C])], "Motion control, 2\u202fs leftRig A: 3 servos"],
  ["two", [lease("Rig A", [A, B]), lease("Rig B", [C])], "Motion controlRig A: 2 servos, Rig B: 1"],
  ["ours", [lease("mine", [A])], "Motion controlYou"],
  ["ours and another", [lease("Rig A", [A]), lease("mine", [B])], "Motion controlRig A: 1 servo, You: 1"],
  [
    "one that has ended",
    [lease("x", [A], { expires_in_s: -1 }), lease("Rig B", null)],
    "Rig B, 2\u202fs left",
  ],
  [
    "a request",
    [lease("x", [A]), lease("y", [B], { request })],
    "Requested by Bob, 9\u202fsx: 1 servo, y: 1",
  ],
])("%s", (_, leases, words) => {
  setLeases(leases);
  tightBar.value = false;
  act(() => render(<TopBar />, host));
  expect(host.querySelector('[data-testid="bar-motion"]')?.textContent).toContain(words);
});

test("a narrow bar has the seconds in the caption, and numbers only", () => {
  const shown = () => host.querySelector('[data-testid="bar-motion"]')?.textContent;
  tightBar.value = true;
  setLeases([lease("Rig A", [A, B])]);
  act(() => render(<TopBar />, host));
  expect(shown()).toBe("Motion control, 2\u202fs leftRig A: 2");
  act(() => setLeases([lease("Rig A", [A, B]), lease("Rig B", [C])]));
  expect(shown()).toBe("Motion controlRig A: 2, Rig B: 1");
});
