/** Groups of the list: places in labels, the order of headings, and what is folded. */
import { beforeEach, expect, test } from "vitest";
import { changeChoices } from "../bench/route";
import { groupBy, grouping, nameBelow, placeIn } from "./grouping";
import { fold, inGroups, isFolded } from "./groups";

beforeEach(() => changeChoices({ group: "", folded: "" }));

test("the place is what stands before the first mark, and a plain name has none", () => {
  expect(placeIn("Left wing / Flap / inner")).toBe("Left wing");
  expect(placeIn("Rig 2: arm")).toBe("Rig 2");
  expect(placeIn("Tail – Elevator")).toBe("Tail");
  expect(placeIn("Elevator L")).toBe("");
  expect(placeIn("T-tail rudder")).toBe("");
});

test("below the heading of its place a servo is called by the rest", () => {
  expect(nameBelow("Left wing / Flap")).toBe("Left wing / Flap");
  groupBy("place");
  expect(nameBelow("Left wing / Flap / inner")).toBe("Flap / inner");
  expect(nameBelow("Left wing /")).toBe("Left wing /");
  expect(nameBelow("Winch")).toBe("Winch");
});

test("headings stand as people count, what has none stands last, and servos keep their order", () => {
  const key: Record<string, string> = { a: "Rig 10", b: "", c: "Rig 9", d: "Rig 10" };
  expect(inGroups(["d", "b", "a", "c"], "place", uid => key[uid] ?? "")).toEqual([
    { key: "Rig 9", uids: ["c"] },
    { key: "Rig 10", uids: ["d", "a"] },
    { key: "", uids: ["b"] },
  ]);
});

test("states stand worst first", () => {
  const key: Record<string, string> = { a: "ok", b: "failure", c: "offline" };
  const found = inGroups(["a", "b", "c"], "state", uid => key[uid] ?? "");
  expect(found.map(one => one.key)).toEqual(["failure", "offline", "ok"]);
});

test("folded groups are kept in the address, and another grouping opens all", () => {
  grouping.value = "place";
  fold("Left wing", true);
  fold("", true);
  expect([isFolded("Left wing"), isFolded(""), isFolded("Tail")]).toEqual([true, true, false]);
  expect(new URLSearchParams(location.search).get("folded")).toBe("Left wing|-");
  fold("Left wing", false);
  expect([isFolded("Left wing"), isFolded("")]).toEqual([false, true]);
  groupBy("model");
  expect(isFolded("")).toBe(false);
  expect(location.search).toBe("?group=model");
});
