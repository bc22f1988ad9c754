/** The filter box: its words, half-typed words, and what is said about wrong ones. */
import { describe, expect, test } from "vitest";
import { EVERYTHING, parseFilter, withProblems, withWord } from "./frame-filter";

const only = (part: object) => ({ filter: { ...EVERYTHING, ...part }, problem: null });

describe("parseFilter", () => {
  test.each([
    ["", {}],
    ["   ", {}],
    ["node:11", { node_id: 11 }],
    ["node:0", { node_id: 0 }],
    ["NODE:127", { node_id: 127 }],
    ["type:GetSet", { type: "GetSet" }],
    ["kind:request", { kind: "request" }],
    ["kind:RESPONSE", { kind: "response" }],
    ["kind:Response", { kind: "response" }],
    ["problems", { problems_only: true }],
    ["Problems", { problems_only: true }],
    ["at CW limit", { text: "at CW limit" }],
    ['"0x08 = 124" node:5', { text: "0x08 = 124", node_id: 5 }],
    ['"problems"', { text: "problems" }],
    ['"node:5"', { text: "node:5" }],
    ["node:11 type:GetSet problems", { node_id: 11, type: "GetSet", problems_only: true }],
    ["servo node:3 1", { node_id: 3, text: "servo 1" }],
    ["1003F30B", { text: "1003F30B" }],
  ])("%s", (box, part) => {
    expect(parseFilter(box)).toEqual(only(part));
  });

  test.each(["node:", "type:", "kind:", "kind:req", 'type:GetSet "half'])(
    "%s is only begun, and no mistake",
    box => {
      expect(parseFilter(box).problem).toBeNull();
    },
  );

  test("a quote that is not closed yet is looked for as far as it goes", () => {
    expect(parseFilter('"at CW li')).toEqual(only({ text: "at CW li" }));
  });

  test.each([
    ["node:128", "Enter 0 to 127"],
    ["node:x", "node:x is not a node ID"],
    ["node:-1", "Enter 0 to 127"],
    ["node:1.5", "Enter 0 to 127"],
    ["kind:foo", "message, request or response"],
    ["nod:11", "nod: is not a filter"],
    ["node:1 node:2", "occurs twice"],
    ["type:A type:B", "occurs twice"],
    ["x".repeat(101), "100 characters"],
    [`type:${"x".repeat(81)}`, "80 characters"],
  ])("%s is refused with a remedy", (box, text) => {
    const found = parseFilter(box);
    expect(found.filter).toBeNull();
    expect(found.problem).toContain(text);
  });

  test("the same word twice is once", () => {
    expect(parseFilter("node:4 node:4")).toEqual(only({ node_id: 4 }));
  });
});

describe("the buttons that write into the box", () => {
  test("a node takes the place of another node and leaves the rest", () => {
    expect(withWord("", "node", 11)).toBe("node:11");
    expect(withWord("type:GetSet node:3 problems", "node", 11)).toBe("type:GetSet problems node:11");
    expect(withWord('"a b"', "type", "Status")).toBe('"a b" type:Status');
  });

  test("problems comes and goes", () => {
    expect(withProblems("node:3", true)).toBe("node:3 problems");
    expect(withProblems("node:3 problems", true)).toBe("node:3 problems");
    expect(withProblems("Problems node:3", false)).toBe("node:3");
  });
});
