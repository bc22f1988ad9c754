/** How the page is put together, where no other tool says it: names that are exported, and what may hold elements. */
import { readdirSync, readFileSync } from "node:fs";
import { expect, test } from "vitest";

const files = readdirSync("src", { recursive: true, encoding: "utf8" }).filter(
  name => /\.tsx?$/.test(name) && !/\.(test|en|ja|d)\.tsx?$/.test(name) && !/^text\/(en|ja)/.test(name),
);

test("an exported name is exported once", () => {
  const found = new Map<string, string[]>();
  for (const file of files) {
    const source = readFileSync(`src/${file}`, "utf8");
    for (const [, name = ""] of source.matchAll(
      /^export (?:async )?(?:const|let|function|class|interface|type) (\w+)/gm,
    )) {
      found.set(name, [...(found.get(name) ?? []), file]);
    }
  }
  expect(found.size).toBeGreaterThan(500);
  expect([...found].filter(([, places]) => new Set(places).size > 1)).toEqual([]);
});

test("nothing below the kit has elements", () => {
  const below = files.filter(file => /^(api|bench|telemetry|text)\//.test(file));
  expect(below.length).toBeGreaterThan(50);
  expect(below.filter(file => file.endsWith(".tsx"))).toEqual([]);
});
