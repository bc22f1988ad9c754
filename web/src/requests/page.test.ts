/** The API page: requests as commands that can be pasted and carry no secret, and operations read from a document. */
import { beforeEach, describe, expect, test, vi } from "vitest";
import type { Sent } from "../api/sent";
import { asCurl, quoted } from "./curl";
import { matching, operationsOf } from "./document";

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

  test("the newest twenty, changes apart from reading, with their answers", async () => {
    const { note, lastSent } = await import("../api/sent");
    const what = { body: undefined, file: undefined, headers: undefined };
    for (let n = 0; n < 30; n += 1) note({ ...what, verb: "GET", path: `/api/v1/servos/${n}` })(200);
    const answered = note({ ...what, verb: "POST", path: "/api/v1/stop" });
    expect(lastSent(false).map(one => [one.path, one.status])).toEqual([["/api/v1/stop", null]]);
    answered(0);
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

describe("the document", () => {
  test("what operations share is found under components", () => {
    const [only] = operationsOf(
      {
        paths: {
          "/stop": {
            post: {
              parameters: [{ $ref: "#/components/parameters/uid" }],
              responses: { default: { $ref: "#/components/responses/CommonProblem" } },
            },
          },
        },
        components: {
          parameters: { uid: { name: "uid", in: "path", required: true, description: "Unique ID." } },
          responses: { CommonProblem: { description: "Refused: `unauthorized`." } },
        },
      },
      of => of,
    );
    expect(only?.arguments).toEqual([
      { name: "uid", where: "path", type: "", required: true, what: "Unique ID." },
    ]);
    expect(only?.answers).toEqual([{ status: "default", what: "Refused: unauthorized." }]);
  });

  const found = operationsOf(
    {
      paths: {
        "/api/v1/servos/{uid}": {
          get: {
            summary: "Get Servo",
            description: "One servo.",
            tags: ["servos"],
            parameters: [
              { name: "uid", in: "path", required: true, schema: { type: "string" } },
              {
                name: "n",
                in: "query",
                schema: { anyOf: [{ type: "integer", minimum: 1, maximum: 9 }, { type: "null" }] },
              },
            ],
            responses: { 200: { description: "Fine" }, 404: { description: "`unknown_servo`" } },
          },
          put: {
            requestBody: {
              content: { "application/json": { schema: { $ref: "#/components/schemas/Name" } } },
            },
            responses: {},
          },
        },
      },
    },
    of => `array of ${of}`,
  );

  test("is read into operations with parameters, body and codes", () => {
    expect(found.map(one => [one.verb, one.summary, one.body])).toEqual([
      ["GET", "One servo.", null],
      ["PUT", "", "Name"],
    ]);
    expect(found[0]?.arguments.map(one => [one.name, one.type, one.required])).toEqual([
      ["uid", "string", true],
      ["n", "integer 1…9", false],
    ]);
    expect(found[0]?.answers[1]).toEqual({ status: "404", what: "unknown_servo" });
  });

  test("every word of a search must be found", () => {
    expect(matching(found, "get SERVOS")).toHaveLength(1);
    expect(matching(found, "get stop")).toHaveLength(0);
    expect(matching(found, " ")).toHaveLength(2);
  });
});
