/** The API page: requests as commands that can be pasted and carry no secret. */
import { beforeEach, describe, expect, test, vi } from "vitest";
import type { Sent } from "../api/sent";
import { asCurl, quoted } from "./curl";

const base: Sent = {
  number: 1,
  verb: "PUT",
  path: "/api/v1/servos/ab/parameters/angle_limit_cw",
  body: { value: 60 },
  file: undefined,
  headers: undefined,
  at: 0,
  status: 200,
  took_ms: 3,
};
const ORIGIN = "http://127.0.0.1:8000";

describe("as curl", () => {
  test("a change carries its body, and the token as a variable only", () => {
    expect(asCurl(base, ORIGIN)).toBe(
      [
        "curl -sS",
        "-X PUT",
        `${ORIGIN}/api/v1/servos/ab/parameters/angle_limit_cw`,
        '-H "Authorization: Bearer $HORNBILL_TOKEN"',
        "-H 'Content-Type: application/json'",
        `-d '{"value":60}'`,
      ].join(" \\\n  "),
    );
  });

  test("neither a token nor a lease of this page stands in it", () => {
    const secret = {
      headers: { Authorization: "Bearer s3cret", Lease: "my-lease", "If-Match": '"7"' },
      body: { value: 1, lease: "my-lease" },
    };
    const curl = asCurl({ ...base, ...secret }, ORIGIN);
    expect(curl).not.toContain("s3cret");
    expect(curl).not.toContain("my-lease");
    expect(curl).toContain('-H "Lease: $LEASE"');
    expect(curl).toContain(`-H 'If-Match: "7"'`);
  });

  test.each([
    ["plain/path:1", "plain/path:1"],
    ["two words", "'two words'"],
    ["it's $HOME `x`", "'it'\\''s $HOME `x`'"],
    ["", "''"],
  ])("%j is quoted for a shell", (word, wanted) => {
    expect(quoted(word)).toBe(wanted);
  });
});

describe("what was sent last", () => {
  beforeEach(() => vi.resetModules());

  test("the newest twenty, changes apart from reads, with their responses", async () => {
    const { note, lastSent } = await import("../api/sent");
    const what = { body: undefined, file: undefined, headers: undefined };
    for (let n = 0; n < 30; n += 1) note({ ...what, verb: "GET", path: `/api/v1/servos/${n}` })(200);
    const respond = note({ ...what, verb: "POST", path: "/api/v1/stop" });
    expect(lastSent(false).map(one => [one.path, one.status])).toEqual([["/api/v1/stop", null]]);
    respond(0);
    expect(lastSent(false)[0]?.status).toBe(0);
    expect(lastSent(true)).toHaveLength(20);
    expect(lastSent(true)[0]?.path).toBe("/api/v1/stop");
    expect(lastSent(true)[1]?.path).toBe("/api/v1/servos/29");
  });

  test.each(["/session", "/tokens", "/tickets", "/leases/abc"])("nothing of %s is kept", async path => {
    const { note, lastSent } = await import("../api/sent");
    note({
      verb: "POST",
      path: `/api/v1${path}`,
      body: { token: "s3cret" },
      file: undefined,
      headers: undefined,
    });
    expect(lastSent(true)).toEqual([]);
  });
});
