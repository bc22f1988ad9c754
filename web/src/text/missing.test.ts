/** The languages say the same things: nothing is missing in Japanese, nothing is left over, and the slots are filled. */
import { readFileSync } from "node:fs";
import { describe, expect, test } from "vitest";
import { Problem } from "../api/client";
import { text } from "./en";
import { topics } from "./en/topics";
import { text as saidText } from "./ja";
import { topics as saidTopics } from "./ja/topics";

/** The paths of what stands in one catalogue and not in the other, such as "bus.doctor.title". */
function missing(one: object, other: object, before = ""): string[] {
  const there = sentences(other, before);
  return [...sentences(one, before).keys()].filter(path => !there.has(path));
}

/** Every sentence of a catalogue by its path; one with slots is filled with the same things in either language. */
function sentences(of: object, before = ""): Map<string, unknown> {
  return new Map(
    Object.entries(of).flatMap(([key, value]): [string, unknown][] => {
      const path = before + key;
      if (typeof value === "object" && value !== null && !Array.isArray(value))
        return [...sentences(value, `${path}.`)];
      return [[path, value]];
    }),
  );
}

describe.each([
  ["every page", text, saidText],
  ["the topics", topics, saidTopics],
])("Japanese of %s", (_, english, japanese) => {
  test("lacks nothing", () => {
    expect(missing(english, japanese)).toEqual([]);
  });

  test("has nothing that English does not have", () => {
    // In English the server's own tables have these names.
    const left = missing(japanese, english).filter(path => !path.startsWith("table."));
    expect(left).toEqual([]);
  });

  test("is not English", () => {
    const there = sentences(english);
    // What is the same in both: names, units, file formats, and sentences that are nothing but slots.
    const same = [...sentences(japanese)].filter(([path, value]) => {
      return typeof value === "string" && value === there.get(path) && /[a-z]{4}/.test(value);
    });
    expect(same.map(([path, value]) => `${path}: ${value}`).filter(line => !SAME.test(line))).toEqual([]);
  });

  test("takes as many slots", () => {
    const there = sentences(english);
    for (const [path, value] of sentences(japanese)) {
      if (typeof value !== "function") continue;
      const other = there.get(path);
      expect(typeof other, path).toBe("function");
      expect(value.length, path).toBeLessThanOrEqual((other as () => unknown).length);
    }
  });
});

const SAME =
  /hornbill|: (candump|socketcan:can0|curl|Python|node:11 type:GetSet problems|JUnit|Space|kbit\/s|HORNBILL_.*)$/;

/** The keys of the server's tables, as the tables have them. */
function keysOf(table: string, part: string): string[] {
  const blocks = readFileSync(`../schemas/${table}.toml`, "utf8").split(/^\[\[/m);
  const wanted = blocks.filter(block => block.startsWith(`${part}]]`));
  return wanted.map(block => /^key = "([a-z_0-9]+)"/m.exec(block)?.[1] ?? "");
}

test("every parameter and every fault has a Japanese name, and every fault advice", () => {
  const faults = keysOf("faults", "fault");
  expect(keysOf("parameters", "parameter").length).toBeGreaterThan(50);
  expect(faults.length).toBeGreaterThan(20);
  expect(keysOf("parameters", "parameter").filter(key => !(key in saidText.table.rows))).toEqual([]);
  expect(faults.filter(key => !(key in saidText.table.faults) || !(key in saidText.table.advice))).toEqual(
    [],
  );
});

test("every refusal that has a sentence of its own has one in Japanese", () => {
  const source = readFileSync("src/text/en.ts", "utf8");
  const codes = [...source.matchAll(/case "([a-z_]+)":/g)].map(found => found[1] ?? "");
  expect(codes).toContain("no_link");
  for (const code of codes) {
    const problem = new Problem(code, 409, "said by the server", { expires_in_s: 3 });
    expect(saidText.problem(problem), code).toMatch(/[\u3040-\u30ff]/);
  }
});
