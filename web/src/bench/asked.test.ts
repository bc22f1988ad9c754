/** Tests what the Records page makes of addresses, files and answers that overtake each other. */
import { describe, expect, it } from "vitest";
import { Problem } from "../api/client";
import { Asked, auditQuery, nameFromFile, partOf, typeOfFile } from "./asked";

const UID = "0123456789abcdef0123456789abcdef";

it("shows the newest answer, whichever comes last", async () => {
  const asked = new Asked<string>();
  let late = (_: string) => {};
  const first = asked.load(() => new Promise(resolve => (late = resolve)));
  await asked.load(async () => "new");
  late("old");
  await first;
  expect(asked.value.value).toBe("new");
});

it("keeps what was read when it cannot be read again, and says why", async () => {
  const asked = new Asked<string>();
  await asked.load(async () => "known");
  await asked.load(async () => {
    throw new Problem("busy", 409, "Being worked on.");
  });
  expect([asked.value.value, asked.problem.value]).toEqual(["known", "Being worked on."]);
});

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
  it("of the audit leave out what is not asked for", () => {
    expect(auditQuery({ uid: "", key: "origin", action: "" })).toBe("?key=origin");
    expect(auditQuery({ uid: "" })).toBe("");
  });
});

it("takes a profile's name and form from its file", () => {
  expect(nameFromFile("Tail rotor.toml")).toBe("Tail rotor");
  expect(typeOfFile("a.TOML")).toBe("application/toml");
  expect(typeOfFile("a.json")).toBe("application/json");
  expect(typeOfFile("a.exe")).toBeNull();
});
