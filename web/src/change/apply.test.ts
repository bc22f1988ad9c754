/** Writes: the requests, and the outcome of each row. */
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Reading } from "../api/types";
import { Sheet } from "../bench/parameters";
import { apply } from "./apply";
import { closeChange, shownChange } from "./flow";

interface Sent {
  method: string;
  path: string;
  body: unknown;
  headers: Record<string, string>;
}

let sent: Sent[];
let sheet: Sheet;
let response: { status: number; body: unknown };

const reading = (key: string, value: number): Reading => ({
  key,
  address: 0x38,
  value,
  configured: value,
  raw: value,
  unit: "°",
  at: 0,
  age_s: 0,
  rom: value,
  default: 0,
  minimum: 0,
  maximum: 180,
  in_effect: true,
  why_not: null,
  why: null,
  stale: false,
  differs_from_default: false,
  unsaved: false,
});

const change = (key: string, verdict: string, after = 5) => ({
  key,
  before: 1,
  requested: 5,
  after,
  verdict,
});

beforeEach(() => {
  sent = [];
  sheet = new Sheet("a".repeat(32));
  for (const key of ["a", "b"]) sheet.put(reading(key, 1));
  sheet.revision = "7";
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    const headers = init.headers as Record<string, string>;
    sent.push({
      method: init.method ?? "",
      path: url,
      body: init.body && JSON.parse(String(init.body)),
      headers,
    });
    if (init.method === "GET") return new Response(JSON.stringify({ revision: "8", parameters: {} }));
    return new Response(JSON.stringify(response.body), { status: response.status });
  });
});

afterEach(() => vi.unstubAllGlobals());

const stage = (key: string, value: number) =>
  sheet.drafts.put(key, { text: String(value), verdict: { ok: true, value } });
const outcome = (key: string) => sheet.outcomes.value.get(key);

describe("apply", () => {
  test("sends what is staged in one piece, with the revision it was made from", async () => {
    response = {
      status: 200,
      body: { outcome: "applied", revision: "8", changes: [change("a", "applied")] },
    };
    stage("a", 5);
    expect(await apply(sheet)).toBe(true);
    expect(sent[0]).toMatchObject({ method: "PATCH", body: { values: { a: 5 } } });
    expect(sent[0]?.headers["If-Match"]).toBe("7");
    expect(sheet.drafts.map.value.size).toBe(0);
    expect(sheet.revision).toBe("8");
    expect(sheet.busy.value).toBeNull();
  });

  test("never sends what is not allowed, nor what RAM holds already", async () => {
    response = {
      status: 200,
      body: { outcome: "applied", revision: "8", changes: [change("a", "applied")] },
    };
    stage("a", 5);
    sheet.drafts.put("b", {
      text: "999",
      verdict: { ok: false, code: "above", what: "", remedy: "", nearest: 180 },
    });
    await apply(sheet);
    expect(sent[0]?.body).toEqual({ values: { a: 5 } });
    expect(sheet.drafts.get("b")?.text).toBe("999");
    sent = [];
    stage("a", 5);
    expect(await apply(sheet)).toBe(true);
    expect(sent).toEqual([]);
  });

  test("of some rows alone leaves the other drafts, and brings the motion control it is given", async () => {
    response = {
      status: 200,
      body: { outcome: "applied", revision: "8", changes: [change("a", "applied")] },
    };
    stage("a", 5);
    stage("b", 6);
    expect(await apply(sheet, { only: ["a"], headers: { Lease: "mine" } })).toBe(true);
    expect(sent[0]?.body).toEqual({ values: { a: 5 } });
    expect(sent[0]?.headers).toMatchObject({ Lease: "mine", "If-Match": "7" });
    expect([...sheet.drafts.map.value.keys()]).toEqual(["b"]);
  });

  test("rolled back: the culprit says why, the others that they were taken back; every draft stays", async () => {
    const changes = [change("a", "no_response", 1), change("b", "rolled_back", 1)];
    const failure = "no response in 3 tries.";
    response = { status: 200, body: { outcome: "rolled_back", revision: "7", changes, failure } };
    stage("a", 5);
    stage("b", 6);
    expect(await apply(sheet)).toBe(false);
    expect(outcome("a")).toMatchObject({ kind: "failed", what: "Not written: no response in 3 tries." });
    expect(outcome("b")).toMatchObject({ kind: "failed", what: expect.stringContaining("a failed") });
    expect(sheet.drafts.map.value.size).toBe(2);
  });

  test("a value clamped by the servo is reported, not shown as written", async () => {
    response = {
      status: 200,
      body: { outcome: "applied", revision: "8", changes: [change("a", "clamped", 4)] },
    };
    stage("a", 5);
    expect(await apply(sheet)).toBe(false);
    expect(outcome("a")).toEqual({ kind: "clamped", requested: 5 });
  });

  test("a problem that names its row stands at that row", async () => {
    const body = {
      code: "out_of_range",
      detail: "5 is above 4.",
      title: "",
      type: "",
      status: 422,
      key: "b",
    };
    response = { status: 422, body };
    stage("a", 5);
    stage("b", 6);
    await apply(sheet);
    expect(outcome("a")).toBeUndefined();
    expect(outcome("b")).toMatchObject({ kind: "failed", what: "Not written: 5 is above 4." });
  });

  test("another client was faster: reported once, values read again, drafts kept", async () => {
    response = {
      status: 412,
      body: { code: "stale_revision", detail: "", title: "", type: "", status: 412 },
    };
    stage("a", 5);
    await apply(sheet);
    expect(sheet.trouble.value).toContain("another client");
    expect(sent.map(one => one.method)).toEqual(["PATCH", "GET"]);
    expect(sheet.drafts.get("a")?.text).toBe("5");
    expect(sheet.revision).toBe("8");
  });

  test("the row shows the value read back, without another read", async () => {
    response = {
      status: 200,
      body: { outcome: "applied", revision: "8", changes: [change("a", "applied")] },
    };
    stage("a", 5);
    await apply(sheet);
    expect(sent.map(one => one.method)).toEqual(["PATCH"]);
    expect(sheet.held("a")).toBe(5);
    expect(sheet.written.value?.changes).toEqual([change("a", "applied")]);
  });

  test("a required confirmation is shown, and the write sent only with it", async () => {
    response = {
      status: 409,
      body: { code: "needs_confirmation", status: 409, detail: "?", confirm: "supply" },
    };
    stage("a", 5);
    expect(await apply(sheet)).toBe(false);
    expect(outcome("a"), "nothing is wrong with it").toBeUndefined();
    const flow = shownChange.value;
    expect(flow?.mayGo.value).toBe(false);
    await flow?.go();
    expect(sent).toHaveLength(1);
    if (flow) flow.agreed.value = ["supply"];
    response = {
      status: 200,
      body: { outcome: "applied", revision: "8", changes: [change("a", "applied")] },
    };
    await flow?.go();
    expect(sent[1]?.body).toEqual({ values: { a: 5 }, confirm: ["supply"] });
    expect(sheet.drafts.map.value.size).toBe(0);
    closeChange();
  });

  test("no server: said at the row", async () => {
    vi.stubGlobal("fetch", async () => {
      throw new TypeError("refused");
    });
    stage("a", 5);
    await apply(sheet);
    expect(outcome("a")).toMatchObject({ kind: "failed", what: "Not written: hornbill does not respond." });
  });
});
