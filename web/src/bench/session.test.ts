/** Who is signed in: what the server says, the token of a link, and the name we go by. */
import { beforeEach, describe, expect, test, vi } from "vitest";
import { look, onSignIn, session, signedBy, signedOut, signIn, tokenRefused } from "./session";

const open = { required: false, name: null, role: "admin", expires_in_s: null };
const anna = { required: true, name: "anna", role: "operate", expires_in_s: 60 };
const anonymous = { required: true, name: null, role: null, expires_in_s: null };

let responses: [number, unknown][] = [];
const sent: [string, unknown][] = [];

beforeEach(() => {
  responses = [];
  sent.length = 0;
  session.value = null;
  signedOut.value = false;
  tokenRefused.value = null;
  vi.stubGlobal("fetch", (path: string, init: RequestInit) => {
    sent.push([`${init.method} ${path}`, init.body]);
    const [status, body] = responses.shift() ?? [500, {}];
    return Promise.resolve(new Response(JSON.stringify(body), { status }));
  });
});

describe("who we are", () => {
  test("without authentication, no login and no name are shown", async () => {
    responses = [[200, open]];
    await look();
    expect(signedOut.value).toBe(false);
    expect(signedBy("page-1000")).toBe("page-1000");
  });

  test("without a token where one is needed, the login is shown", async () => {
    responses = [[200, anonymous]];
    await look();
    expect(signedOut.value).toBe(true);
  });

  test("a token signs in, sets the name, and resolves waiting callers", async () => {
    const reported = vi.fn();
    onSignIn(reported);
    responses = [
      [200, anonymous],
      [200, anna],
    ];
    await look();
    expect(await signIn("hb_x")).toBe(true);
    expect(sent.at(-1)).toEqual(["POST /api/v1/session", '{"token":"hb_x"}']);
    expect(signedOut.value).toBe(false);
    expect(signedBy("page-1000")).toBe("anna · page-1000");
    expect(reported).toHaveBeenCalledOnce();
  });

  test("a token that is refused says why, and the login stays", async () => {
    responses = [
      [200, anonymous],
      [401, { code: "unauthorized", detail: "No token is like this one." }],
    ];
    await look();
    expect(await signIn("wrong")).toBe(false);
    expect(tokenRefused.value?.code).toBe("unauthorized");
    expect(signedOut.value).toBe(true);
  });

  test("a server that does not respond signs no one out", async () => {
    responses = [[200, anna]];
    await look();
    responses = [[502, {}]];
    await look();
    expect(session.value?.name).toBe("anna");
    expect(signedOut.value).toBe(false);
  });
});
