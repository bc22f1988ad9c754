/** What the Records page makes of addresses and names of files. */
import { describe, expect, it } from "vitest";
import { nameFromFile, partOf, typeOfFile } from "./addresses";
import { queryOf } from "./audit";

const UID = "0123456789abcdef0123456789abcdef";

describe("addresses", () => {
  const parts = ["snapshots", "audit"] as const;
  it("name a part and a servo", () => {
    expect(partOf(`snapshots/${UID}`, parts)).toEqual({ part: "snapshots", uid: UID });
    expect(partOf("audit", parts)).toEqual({ part: "audit", uid: null });
  });
  it("lead to the first part when they name none", () => {
    expect(partOf("", parts)).toEqual({ part: "snapshots", uid: null });
    expect(partOf("nonsense/../etc", parts)).toEqual({ part: "snapshots", uid: null });
  });
  it("of the audit omit filters that are not set", () => {
    expect(queryOf({ uid: "", key: "origin", action: "" })).toBe("?key=origin");
    expect(queryOf({ uid: "" })).toBe("");
  });
});

it("takes a profile's name and form from its file", () => {
  expect(nameFromFile("Tail rotor.toml")).toBe("Tail rotor");
  expect(typeOfFile("a.TOML")).toBe("application/toml");
  expect(typeOfFile("a.json")).toBe("application/json");
  expect(typeOfFile("a.exe")).toBeNull();
});
