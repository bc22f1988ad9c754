import { describe, expect, it } from "vitest";
import { isSearched, matchOf } from "./search";

const ONE = { uid: "0a1b2c", label: "Elevator L", serial: "61-020417" };

describe("search of the site", () => {
  it.each([
    ["0204", true],
    ["61-0204", true],
    ["elevator l", true],
    [" 1B2 ", true],
    ["", true],
    ["99", false],
  ])("%j finds it: %s", (typed, expected) => {
    expect(isSearched(ONE, typed)).toBe(expected);
  });

  it("marks the matched part", () => {
    expect(matchOf("61-020417", "0204")).toEqual({ from: 3, to: 7 });
    expect(matchOf("61-020417", "x")).toBeNull();
    expect(matchOf("61-020417", " ")).toBeNull();
  });

  it("finds a servo without a serial by its UID", () => {
    expect(isSearched({ ...ONE, serial: null }, "2c")).toBe(true);
  });
});
