/** Order of the list: which column, which way, and where the unknown stand. */
import { describe, expect, test } from "vitest";
import { ordered, pressed, severity, sortingIn, sortingText } from "./order";

describe("ordered", () => {
  const facts: Record<string, number | null> = { a: 3, b: null, c: -1, d: 3 };
  const of = (uid: string) => facts[uid] ?? null;

  test("what is not known stands at the end, whichever way", () => {
    expect(ordered(["a", "b", "c", "d"], "ascending", of)).toEqual(["c", "a", "d", "b"]);
    expect(ordered(["a", "b", "c", "d"], "descending", of)).toEqual(["a", "d", "c", "b"]);
  });

  test("names with numbers stand as people count", () => {
    const names: Record<string, string> = { a: "Rig 10", b: "Rig 9" };
    expect(ordered(["a", "b"], "ascending", uid => names[uid] ?? null)).toEqual(["b", "a"]);
  });
});

test("a column turns round when pressed again, and a third press gives the list its own order back", () => {
  const up = pressed(null, "name");
  expect(up).toEqual({ column: "name", way: "ascending" });
  const down = pressed(up, "name");
  expect(down?.way).toBe("descending");
  expect(pressed(down, "name")).toBeNull();
  expect(pressed(down, "age")).toEqual({ column: "age", way: "ascending" });
});

test("a failure is worse than a warning, and that worse than OK", () => {
  expect(severity("failure")).toBeLessThan(severity("warning"));
  expect(severity("warning")).toBeLessThan(severity("ok"));
});

test("a sorting is the same after its way through an address, and nonsense is none", () => {
  for (const text of ["", "name", "-age"]) expect(sortingText(sortingIn(text))).toBe(text);
  expect(sortingIn("-nonsense")).toBeNull();
});
