/** Channels and trigger of the scope (in the address) and layouts (in this browser). */
import { signal } from "@preact/signals";
import { inAddress } from "../bench/route";
import {
  idOf,
  type Layout,
  type NamedLayout,
  readChannels,
  readLayouts,
  type ScopeChannel,
  USUAL_RULE,
  writeChannels,
} from "./layout";
import type { Acquisition, Mode, TriggerRule } from "./trigger";

const KEY = "hornbill.scope";

export const channels = inAddress<ScopeChannel[]>("ch", readChannels, writeChannels);
export const hidden = signal<ReadonlySet<string>>(new Set());
export const source = signal<string | null>(null);
export const rule = signal<TriggerRule>(USUAL_RULE);
export const mode = signal<Mode>("run");
export const acquisition = signal<Acquisition>({ state: "free" });

export const layouts = signal<readonly NamedLayout[]>(stored());

function stored(): NamedLayout[] {
  try {
    return readLayouts(JSON.parse(localStorage.getItem(KEY) ?? "null"));
  } catch {
    return [];
  }
}

function keep(next: readonly NamedLayout[]): void {
  layouts.value = next;
  try {
    localStorage.setItem(KEY, JSON.stringify(next));
  } catch {
    // Storage is not available; the layouts last until the page is reloaded.
  }
}

export function saveLayout(name: string, seconds: number): void {
  const layout: Layout = {
    channels: channels.peek().map(one => (hidden.peek().has(idOf(one)) ? { ...one, hidden: true } : one)),
    source: source.peek(),
    rule: rule.peek(),
    seconds,
  };
  keep([...layouts.peek().filter(one => one.name !== name), { name, layout }]);
}

export function removeLayout(name: string): void {
  keep(layouts.peek().filter(one => one.name !== name));
}

export function applyLayout(layout: Layout): void {
  channels.value = layout.channels.map(({ uid, channel }) => ({ uid, channel }));
  hidden.value = new Set(layout.channels.filter(one => one.hidden).map(idOf));
  source.value = layout.source;
  rule.value = layout.rule;
  acquisition.value = { state: "free" };
}
