/** Effect of the trigger on the picture: armed, fired, held. */
import { monotonic } from "../bench/clock";
import type { Drawn } from "../plots/channels";
import type { TimeSpan } from "../plots/span";
import { telemetry } from "../telemetry/store";
import { acquisition, mode, rule, source } from "./state";
import { crossing, step, windowOf } from "./trigger";

/** A channel as drawn, with its letter. */
export type ScopeCurve = Drawn & { letter: string };

/** Check the trigger condition once. */
export function checkTrigger(span: TimeSpan): void {
  const [uid, channel] = source.peek()?.split("/") ?? [];
  const at = telemetry.serverTime(monotonic());
  if (!uid || !channel || Number.isNaN(at)) return;
  const before = acquisition.peek();
  const held = channel.startsWith("command_");
  const fired = (after: number) =>
    crossing(telemetry.ring(uid, channel).since(after), rule.peek(), after, held);
  const next = step(before, at, mode.peek(), rule.peek(), span.seconds.peek(), fired);
  if (next === before || next.state === before.state) return;
  acquisition.value = next;
  if (next.state === "triggered") hold(span, next.at);
}

/** Show a capture; cursors keep their distance from its instant. */
function hold(span: TimeSpan, at: number): void {
  const before = span.still.peek()?.zero;
  const move = (one: number | null) => (one === null || before === undefined ? null : one + at - before);
  const [a, b] = span.cursors.peek();
  span.still.value = windowOf(at, rule.peek(), span.seconds.peek());
  span.cursors.value = [move(a), move(b)];
}

export function reset(span: TimeSpan): void {
  const now = acquisition.peek();
  if (now.state === "triggered") hold(span, now.at);
  else {
    if (mode.peek() === "pause") mode.value = "run";
    span.follow();
  }
}

export function arm(span: TimeSpan): void {
  if (mode.peek() === "pause") mode.value = "single";
  acquisition.value = { state: "free" };
  span.follow();
}
