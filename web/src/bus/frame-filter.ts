/** The monitor's filter box: parsing into the filter that the server applies, and errors in it. */
import type { FrameFilter } from "../api/bus-types";
import { busWords as words } from "./words";

export type FramesWanted = Omit<FrameFilter, "view">;

export const EVERYTHING: FramesWanted = {
  node_id: null,
  type: null,
  kind: null,
  text: null,
  problems_only: false,
};

export type Parsed = { filter: FramesWanted; problem: null } | { filter: null; problem: string };

const KINDS: Record<string, NonNullable<FrameFilter["kind"]>> = {
  message: "message",
  request: "request",
  response: "response",
};

const HIGHEST_NODE = 127;
const LONGEST_TYPE = 80;
const LONGEST_TEXT = 100;

/** A word, or several in quotes. An unclosed quote reaches to the end, since the user may still be typing. */
const WORD = /"([^"]*)"?|[^\s"]+/g;
const KEYED = /^([a-z_]+):(.*)$/i;

/**
 * Parses `node:11 type:GetSet kind:request problems`; other words together are text to search for. Returns the first
 * error; an incomplete word (`node:`) is not an error and filters nothing yet.
 */
export function parseFilter(box: string): Parsed {
  const filter: FramesWanted = { ...EVERYTHING };
  const free: string[] = [];
  for (const found of box.matchAll(WORD)) {
    const word = found[0];
    const keyed = found[1] === undefined ? KEYED.exec(word) : null;
    if (!keyed) {
      if (word.toLowerCase() === "problems") filter.problems_only = true;
      else free.push(found[1] ?? word);
      continue;
    }
    const key = (keyed[1] ?? "").toLowerCase();
    const value = keyed[2] ?? "";
    const problem = take(filter, key, value);
    if (problem !== null) return { filter: null, problem };
  }
  const text = free.join(" ").trim();
  if (text.length > LONGEST_TEXT) return { filter: null, problem: words.filter.longText(LONGEST_TEXT) };
  filter.text = text === "" ? null : text;
  return { filter, problem: null };
}

function take(filter: FramesWanted, key: string, value: string): string | null {
  switch (key) {
    case "node": {
      if (value === "") return null;
      const id = Number(value);
      if (!/^\d+$/.test(value) || id > HIGHEST_NODE) return words.filter.node(value, HIGHEST_NODE);
      if (filter.node_id !== null && filter.node_id !== id) return words.filter.twice("node");
      filter.node_id = id;
      return null;
    }
    case "type":
      if (value === "") return null;
      if (value.length > LONGEST_TYPE) return words.filter.longText(LONGEST_TYPE);
      if (filter.type !== null && filter.type !== value) return words.filter.twice("type");
      filter.type = value;
      return null;
    case "kind": {
      const kinds = Object.keys(KINDS);
      const kind = KINDS[value.toLowerCase()];
      // The beginning of a valid word is not an error yet.
      if (!kind)
        return kinds.some(one => one.startsWith(value.toLowerCase())) ? null : words.filter.kind(value);
      if (filter.kind !== null && filter.kind !== kind) return words.filter.twice("kind");
      filter.kind = kind;
      return null;
    }
    default:
      return words.filter.unknown(key);
  }
}

/** The filter with `key:value`, replacing another value of that key. */
export function withWord(box: string, key: "node" | "type", value: string | number): string {
  const rest = [...box.matchAll(WORD)].map(found => found[0]).filter(word => !word.startsWith(`${key}:`));
  return [...rest, `${key}:${value}`].join(" ");
}

/** The filter with or without the word `problems`. */
export function withProblems(box: string, on: boolean): string {
  const rest = [...box.matchAll(WORD)]
    .map(found => found[0])
    .filter(word => word.toLowerCase() !== "problems");
  return (on ? [...rest, "problems"] : rest).join(" ");
}
