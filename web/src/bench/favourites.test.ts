/** Favourites: marked, taken back, and there again after a reload. */
import { expect, test, vi } from "vitest";

test("a row that is marked is one after a reload, until it is taken back", async () => {
  localStorage.setItem("hornbill.favourites", "no list");
  vi.resetModules();
  const first = await import("./favourites");
  expect([...first.favourites.value]).toEqual([]);
  first.toggleFavourite("angle_p_gain");
  vi.resetModules();
  const again = await import("./favourites");
  expect([...again.favourites.value]).toEqual(["angle_p_gain"]);
  again.toggleFavourite("angle_p_gain");
  expect(localStorage.getItem("hornbill.favourites")).toBe("[]");
});
