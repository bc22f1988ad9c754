/** What the Records page reads out of addresses and names of files. */

/** "snapshots/<uid>": which part, and of which servo. */
export function partOf<T extends string>(hash: string, parts: readonly T[]): { part: T; uid: string | null } {
  const [name, uid] = hash.split("/");
  const part = parts.find(one => one === name) ?? (parts[0] as T);
  return { part, uid: uid !== undefined && /^[0-9a-f]{32}$/.test(uid) ? uid : null };
}

/** A name for a profile from that of its file. */
export function nameFromFile(file: string): string {
  return file
    .replace(/\.(toml|json)$/i, "")
    .replace(/[/\\]/g, " ")
    .trim()
    .slice(0, 80);
}

/** The form a file is in, by its name; null for one that is neither. */
export function typeOfFile(file: string): "application/json" | "application/toml" | null {
  if (/\.toml$/i.test(file)) return "application/toml";
  return /\.json$/i.test(file) ? "application/json" : null;
}
