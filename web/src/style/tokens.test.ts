/** Computes WCAG 2 contrast from tokens.css itself, so that no edit of a colour makes text unreadable. */
import { readdirSync, readFileSync } from "node:fs";
import { describe, expect, test } from "vitest";
import css from "./tokens.css?raw";

function tokensOf(theme: string): Record<string, string> {
  const block = new RegExp(`\\[data-theme="${theme}"\\]\\s*\\{([^}]*)\\}`).exec(css)?.[1] ?? "";
  return Object.fromEntries(
    [...block.matchAll(/--([\w-]+):\s*(#[0-9a-f]{6})/gi)].map(found => [found[1], found[2]]),
  );
}

function luminance(hex: string): number {
  const parts = [1, 3, 5].map(at => {
    const value = Number.parseInt(hex.slice(at, at + 2), 16) / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * (parts[0] ?? 0) + 0.7152 * (parts[1] ?? 0) + 0.0722 * (parts[2] ?? 0);
}

function contrast(a: string, b: string): number {
  const [x, y] = [luminance(a), luminance(b)];
  return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05);
}

const GROUNDS = ["ground", "panel", "raised", "well", "hover"];
const TEXT = [
  "ink",
  "ink-2",
  "ink-3",
  "intent",
  "limit",
  "ok",
  "notice",
  "warning",
  "failure",
  "updating",
  "offline",
];
const TINTS = ["intent", "ok", "notice", "warning", "failure", "updating"];

describe.each(["dark", "light"])("%s", theme => {
  const token = tokensOf(theme);
  const ratio = (a: string, b: string) => contrast(token[a] ?? "", token[b] ?? "");

  test("every token is there", () => {
    for (const name of [...GROUNDS, ...TEXT, "edge", "line", "stop", "on-stop", "primary", "on-primary"]) {
      expect(token[name], name).toMatch(/^#[0-9a-f]{6}$/i);
    }
  });

  test.each(TEXT)("%s can be read on every ground", name => {
    for (const ground of GROUNDS)
      expect(ratio(name, ground), `${name} on ${ground}`).toBeGreaterThanOrEqual(4.5);
  });

  test("edges of controls are seen on every ground", () => {
    for (const ground of GROUNDS) expect(ratio("edge", ground), ground).toBeGreaterThanOrEqual(3);
  });

  test.each(TINTS)("%s, and plain text, can be read on its tint", name => {
    for (const ink of [name, "ink", "ink-2", "ink-3"]) {
      expect(ratio(ink, `${name}-bg`), `${ink} on ${name}-bg`).toBeGreaterThanOrEqual(4.5);
    }
  });

  test("Stop stands out, and its word can be read, pressed or not", () => {
    expect(ratio("on-stop", "stop")).toBeGreaterThanOrEqual(4.5);
    expect(ratio("on-stop", "stop-pressed")).toBeGreaterThanOrEqual(4.5);
    for (const ground of ["panel", "ground", "failure-bg"]) {
      expect(ratio("stop", ground), ground).toBeGreaterThanOrEqual(3);
    }
  });

  test("the primary label can be read on its face", () => {
    expect(ratio("on-primary", "primary")).toBeGreaterThanOrEqual(4.5);
  });

  test("plot series are seen on the plot", () => {
    for (let n = 1; n <= 8; n++) expect(ratio(`series-${n}`, "well"), String(n)).toBeGreaterThanOrEqual(3);
  });
});

const sheets = readdirSync("src", { recursive: true, encoding: "utf8" })
  .filter(name => name.endsWith(".css") && !name.endsWith("tokens.css"))
  .map(name => [name, readFileSync(`src/${name}`, "utf8")] as const);

test.each(sheets)("sizes of type, radii and colours of %s are tokens", (_, sheet) => {
  // On paper the ground is another: print.css gives tokens their values there.
  const used = sheet.replace(/--[\w-]+: [^;]+;/g, "");
  expect(used.match(/font-size: [1-9][\d.]*px|border-radius: [1-9]\d*px|#[0-9a-f]{3,8}\b/gi)).toBeNull();
});

test.each(sheets)("space of the grid in %s is a token", (_, sheet) => {
  const space = sheet.match(/\b(?:gap|padding(?:-\w+)*|margin(?:-\w+)*): [^;{}]+;/g) ?? [];
  expect(
    space.filter(one => !one.includes("calc(") && /(?<![\w.-])(?:4|8|12|16|20|24|32|48)px/.test(one)),
  ).toEqual([]);
});
