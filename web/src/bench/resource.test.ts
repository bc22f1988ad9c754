/** Responses out of order, and the value kept after a failure. */
import { expect, it } from "vitest";
import { Problem } from "../api/client";
import { Resource } from "./resource";

const nothing = async () => "";

it("shows the newest response, whichever arrives last", async () => {
  const requested = new Resource(nothing);
  let late = (_: string) => {};
  const first = requested.load(() => new Promise(resolve => (late = resolve)));
  await requested.load(async () => "new");
  late("old");
  await first;
  expect(requested.value.value).toBe("new");
});

it("keeps what was read when it cannot be read again, and says why", async () => {
  const requested = new Resource(nothing);
  await requested.load(async () => "known");
  await requested.load(async () => {
    throw new Problem("busy", 409, "Being worked on.");
  });
  expect([requested.value.value, requested.problem.value]).toEqual(["known", "Being worked on."]);
});
