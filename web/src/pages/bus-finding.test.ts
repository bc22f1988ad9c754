/** A finding in Japanese: its title with what it names, its remedy, and the server's words where a fact is missing. */
import { beforeEach, expect, test } from "vitest";
import type { Finding } from "../api/bus-types";
import type { Servo } from "../api/types";
import { text } from "../text/ja";
import { topics } from "../text/ja/topics";
import { speak } from "../text/language";

// Before anything that takes its words when it is loaded.
speak(text, topics);
const { told } = await import("./bus-finding");
const { replaceAll } = await import("../state/fleet");

const UID = "ab".repeat(16);

const finding = (code: string, more: Partial<Finding> = {}): Finding => ({
  code,
  severity: "warning",
  text: "Said by the server",
  evidence: "0 frames.",
  remedy: "Do it.",
  ...more,
});

beforeEach(() => replaceAll([]));

test("a title names the node it is about", () => {
  const { title, remedy } = told(finding("duplicate_node_id", { node_ids: [9] }));
  expect(title).toBe("ノードID 9を使う2台のノード");
  expect(remedy).toContain("（パラメーター0x46）");
  expect(told(finding("duplicate_servo_id", { node_ids: [9, 12, 13] })).title).toBe(
    "同じサーボIDを使う3台のサーボ",
  );
});

test("a title names a servo the fleet knows, and is the server's while it does not", () => {
  const gone = finding("servo_offline", { uids: [UID] });
  const silent = finding("silent_node", { uids: [UID], node_ids: [9] });
  expect(told(gone).title).toBe("Said by the server");
  expect(told(silent).title).toBe("ノード9の応答なし");
  replaceAll([{ uid: UID, label: "左" } as Servo]);
  expect(told(gone).title).toBe("左の通信途絶");
  expect(told(silent).title).toBe("左（ノード9）の応答なし");
  expect(told(silent).remedy).toContain("ケーブル");
});

test("sentences that share a code are told apart", () => {
  expect(told(finding("bus_off", { severity: "failure" })).title).toMatch(/バスオフ$/);
  expect(told(finding("bus_off")).title).toMatch(/だった$/);
  expect(told(finding("allocation_stuck")).title).toBe("ノードID待ちのまま進まないノード");
  expect(told(finding("allocation_stuck", { node_ids: [4] })).title).toContain("ノードID 4");
});

test("what is well has its own title and no remedy", () => {
  const well = finding("bus_off", { severity: "ok", remedy: null });
  expect(told(well)).toEqual({ title: "バスに参加中", remedy: null });
});

test("a remedy that is a request is what to do on this page, and a command stays as it is", () => {
  const request = "Switch it on: PUT /api/v1/bus/allocator.";
  expect(told(finding("allocator_off", { remedy: request })).remedy).toBe("ノードIDでオンにしてください。");
  const command = "sudo ip link set can0 up";
  expect(told(finding("interface_down", { remedy: command })).remedy).toBe(command);
});

test("an unknown code is told in the server's words", () => {
  expect(told(finding("new_one"))).toEqual({ title: "Said by the server", remedy: "Do it." });
});
