/** Parsing of the addresses and file names of the Records page. */

/** "snapshots/<uid>": section, and servo. */
export function partOf<T extends string>(hash: string, parts: readonly T[]): { part: T; uid: string | null } {
  const [name, uid] = hash.split("/");
  const part = parts.find(one => one === name) ?? (parts[0] as T);
  return { part, uid: uid !== undefined && /^[0-9a-f]{32}$/.test(uid) ? uid : null };
}

/** A profile name derived from a file name. */
export function nameFromFile(file: string): string {
  return file
    .replace(/\.(toml|json)$/i, "")
    .replace(/[/\\]/g, " ")
    .trim()
    .slice(0, 80);
}

/** File format by name; null for any other. */
export function typeOfFile(file: string): "application/json" | "application/toml" | null {
  if (/\.toml$/i.test(file)) return "application/toml";
  return /\.json$/i.test(file) ? "application/json" : null;
}
