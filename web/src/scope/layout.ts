/** A layout of the scope: channels, trigger and window, no data. Layouts are stored per user, in the browser. */
import { EDGES, type TriggerRule } from "./trigger";

export interface ScopeChannel {
  uid: string;
  channel: string;
  hidden?: boolean;
}

export interface Layout {
  channels: readonly ScopeChannel[];
  /** Trigger channel, "uid/channel"; null without a trigger. */
  source: string | null;
  rule: TriggerRule;
  seconds: number;
}

export interface NamedLayout {
  name: string;
  layout: Layout;
}

export const MOST_CHANNELS = 16;
export const SCOPE_WINDOWS = [0.5, 1, 2, 5, 10, 30, 60, 300] as const;
export const USUAL_RULE: TriggerRule = { level: 0, edge: "rising", before: 0.25, holdoff: 0.5 };

export const idOf = (one: ScopeChannel) => `${one.uid}/${one.channel}`;
export const letterOf = (place: number) => String.fromCharCode(65 + place);

/** Channels as in an address: "UID:current_angle,command_angle;UID:…". */
export function writeChannels(channels: readonly ScopeChannel[]): string {
  const of = new Map<string, string[]>();
  for (const one of channels) of.set(one.uid, [...(of.get(one.uid) ?? []), one.channel]);
  return [...of].map(([uid, keys]) => `${uid}:${keys.join(",")}`).join(";");
}

/** Invalid and repeated entries are left out. */
export function readChannels(text: string): ScopeChannel[] {
  const found = new Map<string, ScopeChannel>();
  for (const part of text.split(";")) {
    const [uid, keys = ""] = part.split(":");
    if (!uid || !/^[0-9a-f]{32}$/.test(uid)) continue;
    for (const channel of keys.split(",")) {
      if (/^[a-z0-9_]+$/.test(channel)) found.set(`${uid}/${channel}`, { uid, channel });
    }
  }
  return [...found.values()].slice(0, MOST_CHANNELS);
}

/** Layouts read from storage; invalid ones are left out. */
export function readLayouts(stored: unknown): NamedLayout[] {
  if (!Array.isArray(stored)) return [];
  return stored.flatMap(one => {
    const name = record(one)?.name;
    const layout = readLayout(record(one)?.layout);
    return typeof name === "string" && name !== "" && layout ? [{ name, layout }] : [];
  });
}

function readLayout(stored: unknown): Layout | null {
  const one = record(stored);
  const rule = record(one?.rule);
  if (!one || !rule || !Array.isArray(one.channels)) return null;
  const channels = one.channels.flatMap((channel): ScopeChannel[] => {
    const { uid, channel: key, hidden } = record(channel) ?? {};
    if (typeof uid !== "string" || typeof key !== "string") return [];
    return readChannels(`${uid}:${key}`).map(read => (hidden === true ? { ...read, hidden } : read));
  });
  const source =
    typeof one.source === "string" && channels.some(each => idOf(each) === one.source) ? one.source : null;
  return {
    channels,
    source,
    rule: {
      level: finite(rule.level, USUAL_RULE.level),
      edge: EDGES.find(each => each === rule.edge) ?? USUAL_RULE.edge,
      before: Math.min(1, Math.max(0, finite(rule.before, USUAL_RULE.before))),
      holdoff: Math.max(0, finite(rule.holdoff, USUAL_RULE.holdoff)),
    },
    seconds: SCOPE_WINDOWS.find(each => each === one.seconds) ?? 10,
  };
}

function record(of: unknown): Record<string, unknown> | null {
  return typeof of === "object" && of !== null ? (of as Record<string, unknown>) : null;
}

function finite(value: unknown, usual: number): number {
  return typeof value === "number" && Number.isFinite(value) ? value : usual;
}
