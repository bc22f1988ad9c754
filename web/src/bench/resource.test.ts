/** Answers that overtake each other, and what stays when one cannot be had. */
import { expect, it } from "vitest";
import { Problem } from "../api/client";
import { Resource } from "./resource";

const nothing = async () => "";

it("shows the newest answer, whichever comes last", async () => {
  const asked = new Resource(nothing);
  let late = (_: string) => {};
  const first = asked.load(() => new Promise(resolve => (late = resolve)));
  await asked.load(async () => "new");
  late("old");
  await first;
  expect(asked.value.value).toBe("new");
});

it("keeps what was read when it cannot be read again, and says why", async () => {
  const asked = new Resource(nothing);
  await asked.load(async () => "known");
  await asked.load(async () => {
    throw new Problem("busy", 409, "Being worked on.");
  });
  expect([asked.value.value, asked.problem.value]).toEqual(["known", "Being worked on."]);
});
