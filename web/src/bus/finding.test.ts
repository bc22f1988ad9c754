/** A finding in Japanese: title, evidence and remedy, and the server's text for unknown codes. */
import { beforeEach, expect, test } from "vitest";
import type { Finding, FindingCode } from "../api/bus-types";
import type { Servo } from "../api/types";
import { text } from "../text/ja";
import { setLanguage } from "../text/language";

// Before modules that read their text when loaded.
setLanguage("ja", text);
const { findingText } = await import("./finding");
const { replaceAll } = await import("../bench/fleet");

const UID = "ab".repeat(16);

const finding = (code: FindingCode, more: Partial<Finding> = {}): Finding => ({
  code,
  severity: "warning",
  text: "Server text",
  evidence: "0 frames.",
  remedy: "Server remedy.",
  advice: null,
  params: {},
  node_ids: [],
  uids: [],
  ...more,
});

beforeEach(() => replaceAll([]));

test("a title names its node", () => {
  const one = finding("duplicate_node_id", { params: { node: 9 }, advice: "renumber_node" });
  expect(findingText(one).title).toBe("ノードID 9を使う2台のノード");
  expect(findingText(one).remedy).toContain("（パラメータ0x46）");
  expect(findingText(finding("duplicate_servo_id", { params: { count: 3, nodes: [9, 12, 13] } })).title).toBe(
    "同じサーボIDを使う3台のサーボ",
  );
});

test("a servo has the name shown on this page, else the server's", () => {
  const gone = finding("servo_offline", { uids: [UID], params: { servo: "SN 1", last_seen_s: 12 } });
  const silent = finding("silent_node", {
    uids: [UID],
    params: { node: 9, servo: "SN 1", requests: 5, last_seen_s: 0.4, over_s: 3 },
    advice: "check_cable_and_restart",
  });
  expect(findingText(gone).title).toBe("SN 1がオフライン");
  replaceAll([{ uid: UID, label: "左" } as Servo]);
  expect(findingText(gone).title).toBe("左がオフライン");
  expect(findingText(silent).title).toBe("左（ノード9）の応答なし");
  expect(findingText(silent).remedy).toContain("ケーブル");
  expect(findingText(finding("silent_node", { params: { node: 9 } })).title).toBe("ノード9の応答なし");
});

test("evidence has values with units", () => {
  const silent = finding("silent_node", { params: { node: 9, requests: 5, last_seen_s: 0.4, over_s: 3 } });
  expect(findingText(silent).evidence).toBe("0.4\u202fs前に受信。3\u202fsに要求5件、応答0件");
});

test("variants of one code have different titles", () => {
  expect(findingText(finding("bus_off", { severity: "failure" })).title).toMatch(/バスオフ$/);
  expect(findingText(finding("bus_off", { params: { ago_s: 2 } })).title).toMatch(/が発生$/);
  expect(findingText(finding("allocation_stuck")).title).toBe("ノードID待ちのまま進まないノード");
  expect(findingText(finding("allocation_stuck", { params: { node: 4 } })).title).toContain("ノードID 4");
});

test("a passed check has its own title and no remedy", () => {
  const well = finding("bus_off", { severity: "ok", remedy: null, params: { times: 0 } });
  expect(findingText(well)).toEqual({ title: "バスに参加中", evidence: "接続後のバスオフ0回", remedy: null });
});

test("a remedy for programs is replaced by one for this page, an adapter's command is unchanged", () => {
  const request = finding("allocator_off", {
    remedy: "PUT /api/v1/bus/allocator.",
    advice: "turn_allocator_on",
  });
  expect(findingText(request).remedy).toBe("「ノードID」でアロケータをオンにしてください。");
  const command = "sudo ip link set can0 up";
  expect(findingText(finding("interface_down", { remedy: command })).remedy).toBe(command);
});

test("an unknown code has the server's text", () => {
  const one = finding("new_one" as FindingCode);
  expect(findingText(one)).toEqual({ title: "Server text", evidence: "0 frames.", remedy: "Server remedy." });
});
