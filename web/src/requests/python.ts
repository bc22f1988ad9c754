/** A request of this page as a complete Python program that uses hornbill.client. */
import { API } from "../api/client";
import type { Sent } from "../api/sent";
import { withoutLease } from "./curl";

/** A JSON value as a Python literal. */
export function literal(value: unknown): string {
  if (value === null || value === undefined) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (Array.isArray(value)) return `[${value.map(literal).join(", ")}]`;
  if (typeof value !== "object") return JSON.stringify(value);
  return `{${Object.entries(value)
    .map(([key, one]) => `${JSON.stringify(key)}: ${literal(one)}`)
    .join(", ")}}`;
}

/** A call with its required arguments and the given optional ones. */
function call(name: string, must: readonly unknown[], given: Readonly<Record<string, unknown>> = {}): string {
  const named = Object.entries(given).filter(([, one]) => one !== undefined && one !== false && !empty(one));
  return `${name}(${[...must.map(literal), ...named.map(([key, one]) => `${key}=${literal(one)}`)].join(", ")})`;
}

const empty = (one: unknown) => one === "" || (Array.isArray(one) && one.length === 0);

type Body = Readonly<Record<string, unknown>>;

interface Step {
  lines: readonly string[];
  /** Needs motion control: placed in a lease block. */
  leased?: boolean;
  imports?: readonly string[];
}

/** Requests with a client method of their own, by verb and path below the servo. */
function onServo(verb: string, rest: string, body: Body, leased: boolean): Step | null {
  const { confirm } = body;
  const one = /^parameters\/(\w+)$/.exec(rest);
  switch (`${verb} ${one ? "parameters/*" : rest}`) {
    case "GET parameters/*":
      return { lines: [`print(${call("servo.read", [one?.[1]])})`] };
    case "PUT parameters/*":
      return { lines: [call("servo.write", [one?.[1], body.value], { confirm })], leased };
    case "PATCH parameters":
      return {
        lines: [call("servo.write_many", [body.values], { dry_run: body.dry_run, save: body.save, confirm })],
        leased,
      };
    case "POST save":
    case "POST restart":
    case "POST identify":
      return { lines: [`servo.${rest}()`], leased };
    case "POST factory-reset":
      return { lines: [`servo.factory_reset(keep_identity=${literal(body.keep_identity ?? true)})`], leased };
    case "POST torque":
      return body.mode === "on"
        ? { lines: [call("servo.torque", [body.mode]), HERE], leased: true, imports: ["time"] }
        : { lines: [call("servo.torque", [body.mode])] };
    case "POST command":
      return commanded(body);
    case "PATCH ":
      return typeof body.label === "string" ? { lines: [call("servo.set_label", [body.label])] } : null;
    default:
      return null;
  }
}

/** Torque goes off at the end of the block: without a pause nothing would be visible. */
const HERE = "time.sleep(2)  # motion control ends with this block, and torque goes off";

function commanded(body: Body): Step {
  const profile = body.profile as { speed_deg_s?: number } | undefined;
  const given = { clamp: body.clamp, confirm: body.confirm, speed_deg_s: profile?.speed_deg_s };
  const on = call("servo.torque", ["on"]);
  if (body.type === "angle") return { lines: [on, call("servo.move", [body.value], given)], leased: true };
  return {
    lines: [on, call("servo.command", [body.type, body.value], given), HERE],
    leased: true,
    imports: ["time"],
  };
}

/** Any other request, by its path. */
function byPath(sent: Sent, path: string, query: URLSearchParams, body: unknown, leased: boolean): Step {
  const named = [...query].filter(([key]) => /^[a-z_]+$/.test(key));
  const file = sent.file;
  if (file !== undefined) {
    const headers = `headers={"Content-Type": ${literal(file)}}`;
    const line = `rig.ask(${literal(sent.verb)}, ${literal(path)}, content=Path("FILE").read_text(encoding="utf-8"), ${headers})`;
    return { lines: [line], leased, imports: ["pathlib"] };
  }
  const must = body === undefined ? [sent.verb, path] : [sent.verb, path, body];
  const line = call("rig.ask", must, Object.fromEntries(named));
  return { lines: [sent.verb === "GET" ? `print(${line})` : line], leased };
}

function stepOf(sent: Sent): { step: Step; uid: string | null } {
  const url = new URL(sent.path, "http://hornbill.invalid");
  const path = url.pathname.slice(url.pathname.indexOf(API) + API.length);
  const body = withoutLease(sent.body);
  const fields = (typeof body === "object" && body !== null ? body : {}) as Body;
  const leased = Object.keys(sent.headers ?? {}).some(name => name.toLowerCase() === "lease");
  const found = /^\/servos\/([0-9a-f]{32})(?:\/(.*))?$/.exec(path);
  if (found?.[1] !== undefined) {
    const step = onServo(sent.verb, found[2] ?? "", fields, leased);
    if (step) return { step, uid: found[1] };
  }
  switch (`${sent.verb} ${path}`) {
    case "GET /servos":
      return { step: { lines: ["print([one.title for one in rig.servos()])"] }, uid: null };
    case "POST /stop":
      return { step: { lines: [stop(fields, url.searchParams)] }, uid: null };
    case "DELETE /stop":
      return { step: { lines: ["rig.clear_stop()"] }, uid: null };
    case "POST /leases":
      return { step: { lines: [HERE], leased: true, imports: ["time"] }, uid: null };
  }
  return { step: byPath(sent, path, url.searchParams, body, leased), uid: null };
}

function stop(body: Body, query: URLSearchParams): string {
  const mode = body.mode ?? query.get("mode") ?? "off";
  return call("rig.stop", mode === "off" ? [] : [mode], { reason: body.reason });
}

/** The request as a program. The client reads the token from HORNBILL_TOKEN; the program has its own lease. */
export function asPython(sent: Sent, origin: string): string {
  const { step, uid } = stepOf(sent);
  const lines = [...(uid === null ? [] : [`servo = rig.find(uid="${uid}")`])];
  if (step.leased) lines.push('with rig.lease("my rig"):', ...step.lines.map(line => `    ${line}`));
  else lines.push(...step.lines);
  const imports = (step.imports ?? []).map(name =>
    name === "pathlib" ? "from pathlib import Path" : `import ${name}`,
  );
  return [
    ...imports,
    ...(imports.length > 0 ? [""] : []),
    "from hornbill.client import Hornbill",
    "",
    `with Hornbill("${origin}") as rig:`,
    ...lines.map(line => `    ${line}`),
  ].join("\n");
}
