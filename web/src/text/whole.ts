/** Owns the fall back to English, key by key, and the list of what a catalogue lacks. */
type Branch = Record<string, unknown>;

function branches(value: unknown): value is Branch {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function merged(english: Branch, said: Branch): Branch {
  const made = { ...english };
  for (const [key, value] of Object.entries(said)) {
    const there = made[key];
    made[key] = branches(there) && branches(value) ? merged(there, value) : value;
  }
  return made;
}

/** `said`, with the English words where it has none. */
export function whole<T extends object>(english: T, said: object): T {
  return merged(english as Branch, said as Branch) as T;
}

/** The paths of what stands in `english` and not in `said`, such as "bus.doctor.title". */
export function missing(english: object, said: object, before = ""): string[] {
  const has = said as Branch;
  return Object.entries(english).flatMap(([key, value]) => {
    const path = before + key;
    if (!(key in has)) return [path];
    return branches(value) && branches(has[key]) ? missing(value, has[key], `${path}.`) : [];
  });
}
