/** A finding in Japanese: its title, evidence and remedy, and the server's words for what the page does not know. */
import { beforeEach, expect, test } from "vitest";
import type { Finding, FindingCode } from "../api/bus-types";
import type { Servo } from "../api/types";
import { text } from "../text/ja";
import { speak } from "../text/language";

// Before anything that takes its words when it is loaded.
speak("ja", text);
const { told } = await import("./finding");
const { replaceAll } = await import("../bench/fleet");

const UID = "ab".repeat(16);

const finding = (code: FindingCode, more: Partial<Finding> = {}): Finding => ({
  code,
  severity: "warning",
  text: "Said by the server",
  evidence: "0 frames.",
  remedy: "Do it.",
  advice: null,
  params: {},
  node_ids: [],
  uids: [],
  ...more,
});

beforeEach(() => replaceAll([]));

test("a title names the node it is about", () => {
  const one = finding("duplicate_node_id", { params: { node: 9 }, advice: "renumber_node" });
  expect(told(one).title).toBe("ノードID 9を使う2台のノード");
  expect(told(one).remedy).toContain("（パラメーター0x46）");
  expect(told(finding("duplicate_servo_id", { params: { count: 3, nodes: [9, 12, 13] } })).title).toBe(
    "同じサーボIDを使う3台のサーボ",
  );
});

test("a servo has the name that this page knows, else the server's", () => {
  const gone = finding("servo_offline", { uids: [UID], params: { servo: "SN 1", heard_s: 12 } });
  const silent = finding("silent_node", {
    uids: [UID],
    params: { node: 9, servo: "SN 1", requests: 5, heard_s: 0.4, over_s: 3 },
    advice: "check_cable_and_restart",
  });
  expect(told(gone).title).toBe("SN 1の通信途絶");
  replaceAll([{ uid: UID, label: "左" } as Servo]);
  expect(told(gone).title).toBe("左の通信途絶");
  expect(told(silent).title).toBe("左（ノード9）の応答なし");
  expect(told(silent).remedy).toContain("ケーブル");
  expect(told(finding("silent_node", { params: { node: 9 } })).title).toBe("ノード9の応答なし");
});

test("evidence is said with its values and units", () => {
  const silent = finding("silent_node", { params: { node: 9, requests: 5, heard_s: 0.4, over_s: 3 } });
  expect(told(silent).evidence).toBe("0.4\u202fs前に受信。3\u202fsに要求5件、応答0件");
});

test("sentences that share a code are told apart", () => {
  expect(told(finding("bus_off", { severity: "failure" })).title).toMatch(/バスオフ$/);
  expect(told(finding("bus_off", { params: { ago_s: 2 } })).title).toMatch(/だった$/);
  expect(told(finding("allocation_stuck")).title).toBe("ノードID待ちのまま進まないノード");
  expect(told(finding("allocation_stuck", { params: { node: 4 } })).title).toContain("ノードID 4");
});

test("what is well has its own title and no remedy", () => {
  const well = finding("bus_off", { severity: "ok", remedy: null, params: { times: 0 } });
  expect(told(well)).toEqual({ title: "バスに参加中", evidence: "接続後のバスオフ0回", remedy: null });
});

test("a remedy that is a request is what to do on this page, and the adapter's stays as it is", () => {
  const request = finding("allocator_off", {
    remedy: "PUT /api/v1/bus/allocator.",
    advice: "turn_allocator_on",
  });
  expect(told(request).remedy).toBe("ノードIDでオンにしてください。");
  const command = "sudo ip link set can0 up";
  expect(told(finding("interface_down", { remedy: command })).remedy).toBe(command);
});

test("an unknown code is told in the server's words", () => {
  const one = finding("new_one" as FindingCode);
  expect(told(one)).toEqual({ title: "Said by the server", evidence: "0 frames.", remedy: "Do it." });
});
