/** Texts of a servo's output: on, off or brake, reason, client, time. */
import type { Servo } from "../api/types";
import { text } from "../text";
import { date, minute } from "./format";
import { holder, who } from "./holder";

export type Output = Servo["output"];

/** Reasons for which a session, not the servo or its configuration, switched an output. */
const SESSION: ReadonlySet<Output["reason"]> = new Set(["stop", "lease", "command"]);

/** True if Stop, the end of a lease, a page or another tool switched the output off. */
export function switchedOff({ state, reason }: Output): boolean {
  return (state === "off" || state === "brake") && SESSION.has(reason);
}

/** One line: "Output off: stopped by you, 14:03". */
export function outputLine(one: Output): string {
  const strings = text.output;
  const state = strings.state[one.state];
  if (one.state === "on" || one.state === "unknown") return state;
  const why = strings.reason[one.reason](by(one));
  return strings.line(state, one.since === null ? why : strings.at(why, instant(one.since)));
}

function by(one: Output): string {
  if (one.by === null) return "";
  if (one.by === holder()) return text.stop.you;
  return one.by === NO_LEASE ? text.output.client : who(one.by);
}

/** The server's name for a client without lease or token. */
const NO_LEASE = "no lease";

function instant(utc: number): string {
  const day = date(utc);
  return day === date(Date.now() / 1000) ? minute(utc) : `${day} ${minute(utc)}`;
}
