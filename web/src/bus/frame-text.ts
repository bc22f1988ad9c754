/** Text of a transfer or frame as a line of the monitor. */
import type { DecodedTransfer, RawFrame } from "../api/bus-types";
import { grouped } from "../bench/format";
import type { FeedRow } from "../telemetry/frame-feed";
import { busWords as words } from "./words";

export interface FrameLine {
  time: string;
  direction: string;
  route: string;
  /** Type, shown bold. */
  head: string;
  text: string;
  /** Data bytes, shown in a fixed-width font. */
  mono: boolean;
  id: string;
  size: string;
  kind: "plain" | "sent" | "problem" | "gap";
}

const strings = words.monitor;

/** "14:02:31.418204" in local time; frames are microseconds apart. */
export function stamp(utc: number): string {
  const at = new Date(Math.floor(utc) * 1000);
  const pair = (n: number) => String(n).padStart(2, "0");
  const micros = String(Math.min(999_999, Math.round((utc % 1) * 1e6))).padStart(6, "0");
  return `${pair(at.getHours())}:${pair(at.getMinutes())}:${pair(at.getSeconds())}.${micros}`;
}

/** "Status" of "uavcan.equipment.actuator.Status". */
export function shortType(type: string): string {
  return type.split(".").at(-1) ?? type;
}

export function typeWords(transfer: DecodedTransfer): string {
  const name = transfer.type === null ? strings.unknownType(transfer.data_type_id) : shortType(transfer.type);
  if (transfer.kind === "request") return `${name} ${strings.request}`;
  return transfer.kind === "response" ? `${name} ${strings.response}` : name;
}

/** The server's summary split into the type and the rest. */
function halves(one: DecodedTransfer): { head: string; text: string } {
  const name = one.type === null ? `Type ${one.data_type_id}` : shortType(one.type);
  const type = one.kind === "message" ? name : `${name} ${one.kind}`; // the summary is in English
  if (one.summary.startsWith(type))
    return { head: typeWords(one), text: one.summary.slice(type.length).trimStart() };
  const head = /^[^,]*/.exec(one.summary)?.[0] ?? "";
  return { head, text: one.summary.slice(head.length).trimStart() };
}

/** Source and destination node in the 29 bits of an identifier (section 4.1.1 of the DroneCAN specification). */
export function endsOf(canId: string): { source: number; destination: number | null } {
  const bits = Number.parseInt(canId, 16) || 0;
  const service = (bits & 0x80) !== 0;
  return { source: bits & 0x7f, destination: service ? (bits >> 8) & 0x7f : null };
}

function route(source: number, destination: number | null): string {
  return `${source} → ${destination ?? strings.all}`;
}

/** Bytes separated by spaces: "0a 3f 00". */
export function spaced(hex: string): string {
  return hex.replace(/..(?=.)/g, "$& ");
}

export function frameLineOf(row: FeedRow, raw: boolean): FrameLine {
  if (row.kind === "gap") {
    const parts = [
      row.lost > 0 ? strings.lost(grouped(row.lost)) : "",
      row.held > 0 ? strings.skipped(grouped(row.held)) : "",
    ];
    const text = parts.filter(part => part !== "").join(" ");
    return { time: "", direction: "", route: "", head: "", text, mono: false, id: "", size: "", kind: "gap" };
  }
  const time = stamp(row.at);
  return { time, ...(row.kind === "transfer" ? ofTransfer(row.transfer) : ofFrame(row.frame, raw)) };
}

function ofTransfer(one: DecodedTransfer): Omit<FrameLine, "time"> {
  return {
    direction: one.sent ? strings.sent : strings.received,
    route: route(one.source, one.destination),
    ...halves(one),
    mono: false,
    id: one.can_id.toUpperCase(),
    size: one.frames > 1 ? strings.framesOf(one.frames) : strings.bytes(one.payload.length / 2),
    kind: one.sent ? "sent" : "plain",
  };
}

function ofFrame(one: RawFrame, raw: boolean): Omit<FrameLine, "time"> {
  const { source, destination } = endsOf(one.can_id);
  const problem = one.problem !== null;
  return {
    direction: one.sent ? strings.sent : strings.received,
    route: route(source, destination),
    head: problem && !raw ? strings.notDecoded : "",
    text: raw ? `${spaced(one.data)}${problem ? `   ${one.problem}` : ""}` : (one.problem ?? ""),
    mono: raw,
    id: one.can_id.toUpperCase(),
    size: strings.bytes(one.data.length / 2),
    kind: problem ? "problem" : one.sent ? "sent" : "plain",
  };
}

/** Leaves of the decoded fields, such as "value.integer_value = 124"; at most `most`. */
export function leaves(fields: Record<string, unknown>, most: number): { name: string; value: string }[] {
  const out: { name: string; value: string }[] = [];
  const walk = (name: string, value: unknown): void => {
    if (out.length >= most) return;
    if (Array.isArray(value)) {
      // Lists of plain values are shown in one line.
      if (value.every(one => typeof one !== "object" || one === null)) {
        out.push({ name, value: `[${value.map(plain).join(", ")}]` });
      } else for (const [place, one] of value.entries()) walk(`${name}[${place}]`, one);
    } else if (typeof value === "object" && value !== null) {
      const inner = Object.entries(value);
      if (inner.length === 0) out.push({ name, value: "–" });
      for (const [key, one] of inner) walk(name === "" ? key : `${name}.${key}`, one);
    } else out.push({ name, value: plain(value) });
  };
  if (Object.keys(fields).length > 0) walk("", fields);
  return out;
}

function plain(value: unknown): string {
  if (typeof value === "number") return String(value).replace("-", "\u2212");
  return value === null ? "–" : String(value);
}
