/** A request of the page as a Python program: with the client's own methods, and nothing of this page in it. */
import { describe, expect, test } from "vitest";
import type { Sent } from "../api/sent";
import { asPython, literal } from "./python";

const UID = `${"0".repeat(31)}a`;
const ORIGIN = "http://127.0.0.1:8000";

const sent = (verb: string, path: string, body?: unknown, headers?: Record<string, string>): Sent => ({
  number: 1,
  verb,
  path: `/api/v1${path}`,
  body,
  file: undefined,
  headers,
  at: 0,
  status: 200,
  took_ms: 3,
});

const LEASE = { Lease: "my-lease" };
const servo = `servo = rig.find(uid="${UID}")`;

/** What stands in the block of the connection, without its indent. */
const inside = (one: Sent) =>
  (asPython(one, ORIGIN).split(`with Hornbill("${ORIGIN}") as rig:\n`)[1] ?? "")
    .split("\n")
    .map(line => line.slice(4));

test("it is a whole program", () => {
  expect(asPython(sent("POST", `/servos/${UID}/save`), ORIGIN)).toBe(
    [
      "from hornbill.client import Hornbill",
      "",
      `with Hornbill("${ORIGIN}") as rig:`,
      `    ${servo}`,
      "    servo.save()",
    ].join("\n"),
  );
});

describe("the client's own methods", () => {
  test.each<[string, Sent, string[]]>([
    [
      "values of the Parameters page",
      sent(
        "PATCH",
        `/servos/${UID}/parameters`,
        { values: { angle_limit_cw: 60, smoothing: true } },
        { "If-Match": "7" },
      ),
      [servo, 'servo.write_many({"angle_limit_cw": 60, "smoothing": True})'],
    ],
    [
      "with a word that was agreed to",
      sent("PATCH", `/servos/${UID}/parameters`, {
        values: { voltage_limit_lower: 7.2 },
        confirm: ["supply"],
        dry_run: false,
        save: true,
      }),
      [servo, 'servo.write_many({"voltage_limit_lower": 7.2}, save=True, confirm=["supply"])'],
    ],
    [
      "one value",
      sent("PUT", `/servos/${UID}/parameters/reverse`, { value: false }),
      [servo, 'servo.write("reverse", False)'],
    ],
    [
      "a save while motion is on",
      sent("POST", `/servos/${UID}/save`, undefined, LEASE),
      [servo, 'with rig.lease("my rig"):', "    servo.save()"],
    ],
    [
      "an angle",
      sent(
        "POST",
        `/servos/${UID}/command`,
        { type: "angle", value: -12.5, profile: { speed_deg_s: 90, accel_deg_s2: 360 } },
        LEASE,
      ),
      [servo, 'with rig.lease("my rig"):', '    servo.torque("on")', "    servo.move(-12.5, speed_deg_s=90)"],
    ],
    [
      "torque off needs nothing",
      sent("POST", `/servos/${UID}/torque`, { mode: "off" }),
      [servo, 'servo.torque("off")'],
    ],
    ["stop", sent("POST", "/stop?by=Page%2012", { mode: "off", reason: "" }), ["rig.stop()"]],
    ["stop with the brake", sent("POST", "/stop?by=Page%2012", { mode: "brake" }), ['rig.stop("brake")']],
    ["stop cleared", sent("DELETE", "/stop?by=Page%2012"), ["rig.clear_stop()"]],
    [
      "a name",
      sent("PATCH", `/servos/${UID}`, { label: "Elevator L" }),
      [servo, 'servo.set_label("Elevator L")'],
    ],
  ])("%s", (_, one, wanted) => expect(inside(one)).toEqual(wanted));

  test("a speed is held for a while, for the end of the block ends it", () => {
    const lines = inside(sent("POST", `/servos/${UID}/command`, { type: "speed", value: 30 }, LEASE));
    expect(lines.slice(1, 4)).toEqual([
      'with rig.lease("my rig"):',
      '    servo.torque("on")',
      '    servo.command("speed", 30)',
    ]);
    expect(lines[4]).toContain("time.sleep(2)");
  });

  test("motion control is a block", () => {
    const program = asPython(sent("POST", "/leases", { holder: "Page 12", ttl_s: 3 }), ORIGIN);
    expect(program).toMatch(/^import time\n/);
    expect(program).toContain('    with rig.lease("my rig"):\n        time.sleep(2)');
    expect(program).not.toContain("Page 12");
  });
});

test("anything else is requested by its path, with query and body, without this page's lease", () => {
  const one = sent(
    "POST",
    "/profiles/a%20b/apply?wait=true",
    { uids: [UID], lease: "my-lease", note: null },
    LEASE,
  );
  expect(inside(one)).toEqual([
    'with rig.lease("my rig"):',
    `    rig.ask("POST", "/profiles/a%20b/apply", {"uids": ["${UID}"], "note": None}, wait="true")`,
  ]);
});

test("below the path of a proxy", () => {
  const one = { ...sent("POST", "/stop"), path: "/bench/api/v1/stop?by=x" };
  expect(asPython(one, `${ORIGIN}/bench`)).toContain("rig.stop()");
});

test("values of JSON are those of Python", () => {
  expect(literal({ a: [true, false, null, 1.5, 'say "hi"'] })).toBe(
    '{"a": [True, False, None, 1.5, "say \\"hi\\""]}',
  );
});
