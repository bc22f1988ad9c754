/** Drafts: what is staged, what is not, what undo takes back. */
import { signal } from "@preact/signals";
import { describe, expect, test } from "vitest";
import { Drafts, staged, wrong } from "./draft";

const good = (value: number) => ({ text: String(value), verdict: { ok: true as const, value } });
const bad = {
  text: "x",
  verdict: { ok: false as const, code: "not_a_number" as const, what: "", remedy: "", nearest: null },
};
const held = () => 5;

describe("Drafts", () => {
  test("only legal values that differ from RAM are staged", () => {
    const drafts = new Drafts();
    drafts.put("a", good(1));
    drafts.put("b", bad);
    drafts.put("c", good(5));
    expect([...staged(drafts.map.value, held)]).toEqual([["a", 1]]);
    expect(wrong(drafts.map.value)).toEqual(["b"]);
  });

  test("leaving a box with RAM's own value leaves no draft", () => {
    const drafts = new Drafts();
    drafts.put("a", good(5));
    drafts.commit("a", 5);
    expect(drafts.get("a")).toBeUndefined();
  });

  test("leaving a box with a wrong value keeps it, so that it can be put right", () => {
    const drafts = new Drafts();
    drafts.put("a", bad);
    drafts.commit("a", 5);
    expect(drafts.get("a")).toBe(bad);
  });

  test("undo takes back a whole edit, not a keystroke", () => {
    const drafts = new Drafts();
    drafts.put("a", good(1));
    drafts.put("a", good(12));
    drafts.commit("a", 5);
    drafts.put("b", good(2));
    drafts.commit("b", 5);
    drafts.put("a", good(3));
    drafts.commit("a", 5);
    expect(drafts.undo()).toBe("a");
    expect(drafts.get("a")?.text).toBe("12");
    expect(drafts.undo()).toBe("b");
    expect(drafts.undo()).toBe("a");
    expect(drafts.map.value.size).toBe(0);
    expect(drafts.undo()).toBeNull();
  });

  test("a verdict that changes is no edit: undo takes back what was typed", () => {
    const wrongNow = signal(false);
    const drafts = new Drafts(key => (key === "a" && wrongNow.value ? bad.verdict : null));
    drafts.put("a", good(1));
    drafts.commit("a", 5);
    wrongNow.value = true;
    expect(drafts.get("a")).toEqual({ text: "1", verdict: bad.verdict });
    wrongNow.value = false;
    expect(drafts.get("a")).toEqual(good(1));
    expect(drafts.undo()).toBe("a");
    expect(drafts.undo()).toBeNull();
  });

  test("discard leaves nothing, not even for undo", () => {
    const drafts = new Drafts();
    drafts.put("a", good(1));
    drafts.clear();
    expect(drafts.map.value.size).toBe(0);
    expect(drafts.undo()).toBeNull();
  });
});
