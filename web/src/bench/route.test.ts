/** Addresses: what they lead to, below a proxy's path too, and the choices they keep. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import * as here from "./route";

const uid = "0123456789abcdef0123456789abcdef";

beforeEach(() => history.replaceState(null, "", "/servos"));
afterEach(() => {
  vi.useRealTimers();
  here.go("/servos", true);
});

describe("parse", () => {
  test.each([
    ["", "servos", null],
    ["/", "servos", null],
    ["/servos", "servos", null],
    ["/servos/", "servos", null],
    ["/servos/matrix", "matrix", null],
    [`/servos/${uid}`, "overview", uid],
    [`/servos/${uid}/motion`, "motion", uid],
    ["/bus/", "bus", null],
    ["/api-page", "api", null],
    ["/nothing", "missing", null],
    ["/servos/12", "missing", null],
    [`/servos/${uid}/nothing`, "missing", null],
  ])("%s is %s", (path, page, servo) => {
    expect(here.parse(path, "")).toEqual({ page, uid: servo, hash: "" });
  });

  test("a part that is no escape is taken as it stands", () => {
    expect(here.parse("/bus", "#50%").hash).toBe("50%");
    expect(here.parse("/records", "#recorder/a%20b").hash).toBe("recorder/a b");
  });
});

describe("below a proxy's path", () => {
  afterEach(() => {
    document.head.innerHTML = "";
    vi.resetModules();
  });

  test("every page's address has that path, and leads back to it", async () => {
    document.head.innerHTML = '<meta name="hornbill-root" content="/hornbill">';
    vi.resetModules();
    await import("../text/setup");
    const below = await import("./route");
    const { matrixPath } = await import("../servos/selection-bar");
    const paths = [
      [matrixPath([uid, uid]), "matrix", null],
      [below.pathOf("servos", null), "servos", null],
      [below.pathOf("parameters", uid, "node_id"), "parameters", uid],
      [below.pathOf("tune", null), "tune", null],
      [below.pathOf("api", null), "api", null],
    ] as const;
    for (const [path, page, servo] of paths) {
      expect(path).toMatch(/^\/hornbill\//);
      below.go(path);
      expect(location.pathname + location.search + location.hash).toBe(path);
      expect(below.route.value).toMatchObject({ page, uid: servo });
    }
  });
});

describe("choices of a page", () => {
  const search = here.wordInAddress("q");
  const filter = here.oneInAddress("filter", ["all", "changed"]);

  test("are in the address, the usual ones left out", () => {
    search.value = "angle limit";
    filter.value = "changed";
    expect(location.search).toBe("?q=angle+limit&filter=changed");
    search.value = "";
    filter.value = "all";
    expect(location.pathname + location.search).toBe("/servos");
  });

  test("come again with Back", () => {
    search.value = "winch";
    here.go(here.pathOf("bus", null));
    expect(search.value).toBe("");
    // Back, as the browser makes it.
    history.replaceState(null, "", "/servos?q=winch&filter=nonsense");
    here.startRoute();
    dispatchEvent(new PopStateEvent("popstate"));
    expect([here.route.value.page, search.value, filter.value]).toEqual(["servos", "winch", "all"]);
  });

  test("go with the page to another servo", () => {
    const other = "f".repeat(32);
    here.go(here.pathOf("parameters", uid, "", { tab: "limits" }));
    expect(here.sameFor(other)).toBe(`/servos/${other}/parameters?tab=limits`);
  });

  test("typing leaves the part of the page and the history alone", () => {
    here.go(here.pathOf("bus", null, "monitor"));
    const before = history.length;
    for (const typed of ["n", "no", "nod"]) search.value = typed;
    expect([location.search, location.hash, history.length]).toEqual(["?q=nod", "#monitor", before]);
    here.changeChoices({ q: "" }, "nodes");
    expect([location.search, location.hash]).toEqual(["", "#nodes"]);
    expect(here.route.value.hash).toBe("nodes");
  });

  test("a browser that allows no more changes for now gets the last one later", () => {
    vi.useFakeTimers();
    const refuse = vi.spyOn(history, "replaceState").mockImplementation(() => {
      throw new DOMException("too many", "SecurityError");
    });
    search.value = "a";
    search.value = "ab";
    expect(search.value).toBe("ab");
    refuse.mockRestore();
    vi.advanceTimersByTime(2000);
    expect(location.search).toBe("?q=ab");
  });
});
