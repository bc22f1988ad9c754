/** The languages say the same things: nothing is missing in Japanese, nothing is left over, and the slots are filled. */
import { readFileSync } from "node:fs";
import { describe, expect, test } from "vitest";
import { Problem } from "../api/client";
import { words as explainedInJapanese } from "../bench/row-help.ja";
import { text } from "./en";
import { text as saidText } from "./ja";
import { codes as codesInJapanese } from "./ja/codes";

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

/** In English the server says these itself. */
const BY_CODE = /^(table|bench\/row-help|bus\/findings|change\/steps\.evidence)\./;

/** The files of words that are fetched with a part of the page, by their path. */
const files = import.meta.glob<{ words?: object }>("../*/*.{en,ja}.ts", { eager: true });
const parts = Object.entries(files).flatMap(([path, { words }]) => {
  if (words === undefined || path.endsWith(".ja.ts")) return [];
  const name = path.slice("../".length, -".en.ts".length);
  return [[name, { [name]: words }, { [name]: files[`../${name}.ja.ts`]?.words ?? {} }] as const];
});

test("the files of words are found", () => {
  expect(parts.length).toBeGreaterThan(20);
});

describe.each([["every page", text, saidText], ...parts] as const)(
  "Japanese of %s",
  (_, english, japanese) => {
    test("lacks nothing", () => {
      expect(missing(english, japanese)).toEqual([]);
    });

    test("has nothing that English does not have", () => {
      const left = missing(japanese, english).filter(path => !BY_CODE.test(path));
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
        if (typeof value !== "function" || BY_CODE.test(path)) continue;
        const other = there.get(path);
        expect(typeof other, path).toBe("function");
        expect(value.length, path).toBeLessThanOrEqual((other as () => unknown).length);
      }
    });
  },
);

const SAME =
  /hornbill|: (candump|socketcan:can0|curl|Python|node:11 type:GetSet problems|JUnit|Space|kbit\/s|Ctrl Enter|ArduPilot|ArrayCommand|HORNBILL_.*)$/;

/** A field of each row of the server's tables that has it, by the row's key. */
function fieldOf(table: string, part: string, field: string): Map<string, string> {
  const blocks = readFileSync(`../schemas/${table}.toml`, "utf8").split(/^\[\[/m);
  const find = (block: string, name: string) => new RegExp(`^${name} = "(.+)"$`, "m").exec(block)?.[1];
  const rows = blocks.filter(block => block.startsWith(`${part}]]`));
  return new Map(
    rows.flatMap(row => {
      const value = find(row, field);
      return value === undefined ? [] : [[find(row, "key") ?? "", value] as const];
    }),
  );
}

/** The keys of the server's tables, as the tables have them. */
const keysOf = (table: string, part: string) => [...fieldOf(table, part, "key").keys()];

test("every parameter and every fault has a Japanese name, and every fault advice", () => {
  const faults = keysOf("faults", "fault");
  expect(keysOf("parameters", "parameter").length).toBeGreaterThan(50);
  expect(faults.length).toBeGreaterThan(20);
  expect(keysOf("parameters", "parameter").filter(key => !(key in saidText.table.rows))).toEqual([]);
  expect(faults.filter(key => !(key in saidText.table.faults) || !(key in saidText.table.advice))).toEqual(
    [],
  );
});

test("every firmware has a Japanese note with the numbers of the server's", () => {
  const blocks = readFileSync("../schemas/parameters.toml", "utf8")
    .split(/^\[\[firmware\]\]$/m)
    .slice(1);
  const find = (block: string, name: string) => new RegExp(`^${name} = "(.+)"$`, "m").exec(block)?.[1] ?? "";
  const notes = new Map<string, string>(Object.entries(saidText.table.firmware));
  expect(blocks.map(block => find(block, "version"))).toEqual([...notes.keys()]);
  for (const block of blocks) {
    const numbers = find(block, "note").match(/0x[\dA-F]{2}|\d+\.\d{3}/g) ?? [];
    const note = notes.get(find(block, "version")) ?? "";
    expect(numbers.filter(number => !note.includes(number))).toEqual([]);
  }
});

test("every parameter, every tab and what the maker advises is explained in Japanese", () => {
  const explained = fieldOf("parameters", "parameter", "description");
  const advised = fieldOf("parameters", "parameter", "advice");
  expect(explained.size).toBeGreaterThan(50);
  expect(advised.size).toBeGreaterThan(0);
  const rows = new Map<string, string>(Object.entries(explainedInJapanese.rows));
  const { groups, advice } = explainedInJapanese;
  expect([...explained.keys()].filter(key => !rows.has(key))).toEqual([]);
  expect(Object.keys(saidText.table.groups).filter(key => !(key in groups))).toEqual([]);
  expect([...advised.keys()].filter(key => !(key in advice))).toEqual([]);
  for (const [key, sentence] of explained) {
    const numbers = sentence.match(/0x[\dA-F]{2}|±?\d+(\.\d+)?/g) ?? [];
    expect(
      numbers.filter(number => !rows.get(key)?.includes(number)),
      key,
    ).toEqual([]);
  }
});

test("every refusal that has a sentence of its own has one in Japanese", () => {
  const source = readFileSync("src/text/en.ts", "utf8");
  const codes = [...source.matchAll(/case "([a-z_]+)":/g)].map(found => found[1] ?? "");
  expect(codes).toContain("no_link");
  for (const code of codes) {
    const problem = new Problem(code, 409, "said by the server", { expires_in_s: 3 });
    expect(codesInJapanese.problem(problem, {}), code).toMatch(/[\u3040-\u30ff]/);
  }
});
