/** Texts of the bus page: lines of the monitor, remedies, typed bit rates and node IDs. */
import { describe, expect, test } from "vitest";
import type { Adapter, Allocation, DecodedTransfer, RawFrame } from "../api/bus-types";
import { channelOf } from "../bench/bus-now";
import { grouped, size } from "../bench/format";
import { endsOf, frameLineOf, leaves, spaced, stamp } from "./frame-text";
import { wrongId } from "./id-dialogs";
import { bitrateOf, chosenOf, gapOf } from "./picker";
import { pieces } from "./remedy";

const transfer = (part: Partial<DecodedTransfer>): DecodedTransfer => ({
  timestamp: 1.000_25,
  type: "uavcan.protocol.param.GetSet",
  kind: "request",
  data_type_id: 11,
  source: 126,
  destination: 12,
  priority: 26,
  transfer_id: 3,
  fields: {},
  payload: "000030783038",
  summary: "GetSet request read 0x08 current_angle",
  sent: true,
  can_id: "1a0b8cfe",
  frames: 1,
  ...part,
});
const line = (part: Partial<DecodedTransfer>) =>
  frameLineOf({ kind: "transfer", at: 1.000_25, transfer: transfer(part) }, false);

describe("a line of the monitor", () => {
  test("says who, to whom, what, and how large", () => {
    expect(line({})).toMatchObject({
      direction: "TX",
      route: "126 → 12",
      head: "GetSet request",
      text: "read 0x08 current_angle",
      id: "1A0B8CFE",
      size: "6\u202fbytes",
      kind: "sent",
    });
  });

  test("broadcast, received, and of several frames", () => {
    const found = line({
      type: "uavcan.equipment.actuator.Status",
      kind: "message",
      destination: null,
      sent: false,
      frames: 2,
      summary: "Status servo 1, 12.4°",
    });
    expect(found).toMatchObject({
      direction: "RX",
      route: "126 → all",
      head: "Status",
      text: "servo 1, 12.4°",
    });
    expect(found.size).toBe("2\u202fframes");
  });

  test("an unknown type uses the start of the summary", () => {
    const found = line({
      type: null,
      kind: "message",
      data_type_id: 999,
      summary: "Unknown message 999, 8 bytes",
    });
    expect([found.head, found.text]).toEqual(["Unknown message 999", ", 8 bytes"]);
  });

  test("a frame nothing could be made of says why, in either view", () => {
    const frame: RawFrame = {
      timestamp: 1,
      sent: false,
      can_id: "1003f309",
      data: "0a3f00",
      problem: "toggle bit error",
    };
    const row = { kind: "frame", at: 1, frame } as const;
    expect(frameLineOf(row, false)).toMatchObject({
      head: "Not decoded",
      text: "toggle bit error",
      kind: "problem",
    });
    expect(frameLineOf(row, true)).toMatchObject({
      text: "0a 3f 00   toggle bit error",
      mono: true,
      kind: "problem",
    });
    expect(frameLineOf({ ...row, frame: { ...frame, problem: null } }, true)).toMatchObject({
      text: "0a 3f 00",
      kind: "plain",
    });
  });

  test("a gap says how much is missing", () => {
    expect(frameLineOf({ kind: "gap", at: 1, lost: 1200, held: 0 }, false).text).toContain("1\u202f200 lost");
    expect(frameLineOf({ kind: "gap", at: 1, lost: 0, held: 3 }, false).text).toContain("3 not stored");
  });

  test.each([
    ["10015511", { source: 0x11, destination: null }],
    ["1a0b8cfe", { source: 126, destination: 12 }],
    ["00000000", { source: 0, destination: null }],
  ])("source and destination of %s", (id, ends) => {
    expect(endsOf(id)).toEqual(ends);
  });

  test("times have microseconds and never a second too many", () => {
    expect(stamp(1.000_25)).toMatch(/^\d\d:\d\d:01\.000250$/);
    expect(stamp(59.999_999_9)).toMatch(/:59\.999999$/);
  });

  test("bytes stand apart", () => {
    expect([spaced(""), spaced("0a"), spaced("0a3f00")]).toEqual(["", "0a", "0a 3f 00"]);
  });
});

describe("the fields of a transfer", () => {
  test("are listed leaf by leaf, short lists in one line, with true minus signs", () => {
    const fields = {
      value: { kind: "integer", value: -5 },
      list: [1, 2],
      deep: [{ a: null }],
      none: {},
      text: "x",
    };
    expect(leaves(fields, 80)).toEqual([
      { name: "value.kind", value: "integer" },
      { name: "value.value", value: "−5" },
      { name: "list", value: "[1, 2]" },
      { name: "deep[0].a", value: "–" },
      { name: "none", value: "–" },
      { name: "text", value: "x" },
    ]);
    expect(leaves({}, 80)).toEqual([]);
    expect(leaves({ many: Array.from({ length: 99 }, () => ({ a: 1 })) }, 10)).toHaveLength(10);
  });
});

describe("a remedy", () => {
  const up = "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875";
  test.each([
    ["Check the cable.", undefined, [{ text: "Check the cable." }]],
    [
      `The interface can0 is down. Bring it up with: ${up}`,
      up,
      [{ text: "The interface can0 is down. Bring it up with:" }, { command: up }],
    ],
    [
      "Run: sudo usermod -aG dialout $USER, then log in again.",
      "sudo usermod -aG dialout $USER",
      [{ text: "Run:" }, { command: "sudo usermod -aG dialout $USER" }, { text: "Then log in again." }],
    ],
    [
      "次のコマンドを実行し、ログインし直してください: sudo usermod -aG dialout $USER",
      "sudo usermod -aG dialout $USER",
      [
        { text: "次のコマンドを実行し、ログインし直してください:" },
        { command: "sudo usermod -aG dialout $USER" },
      ],
    ],
    [
      "Type `ip link` and look.",
      undefined,
      [{ text: "Type" }, { command: "ip link" }, { text: "And look." }],
    ],
    ["sudo modprobe can_raw", "sudo modprobe can_raw", [{ command: "sudo modprobe can_raw" }]],
  ])("%s", (remedy, command, shown) => {
    expect(pieces(remedy, command)).toEqual(shown);
  });
});

describe("what is typed", () => {
  test.each([
    ["1000", 1_000_000],
    ["83.333", 83_333],
    ["83,33", 83_330],
    ["83,333", null],
    ["１０００ｋｂｉｔ／ｓ", 1_000_000],
    ["0x3E8", null],
    [" 500 ", 500_000],
    ["9", null],
    ["1001", null],
    ["", null],
    ["1 M", null],
  ])("a bit rate of %s kbit/s", (typed, bits) => {
    expect(bitrateOf(typed)).toBe(bits);
  });

  test.each([
    ["0", 0],
    ["3", 3],
    ["2,5", 2.5],
    ["20", 20],
    ["21", null],
    ["-1", null],
    ["", null],
  ])("a pause of %s ms between frames", (typed, pause) => {
    expect(gapOf(typed)).toBe(pause);
  });

  test("a node ID that is invalid or assigned to another node is refused before it is sent", () => {
    const one = (uid: string, node_id: number): Allocation => ({
      uid,
      node_id,
      pinned: false,
      last_seen: null,
      online: true,
    });
    const mine = one("aaaa0000aaaa0000aaaa0000aaaa0000", 5);
    const table = [mine, one("bbbb0000bbbb0000bbbb0000bbbb0000", 6)];
    expect(wrongId("5", mine, table)).toBeNull();
    expect(wrongId(" 125 ", mine, table)).toBeNull();
    expect(wrongId("１２５", mine, table)).toBeNull();
    expect(wrongId("6", mine, table)).toContain("is assigned to bbbb…0000");
    for (const typed of ["0", "126", "-1", "1.5", "x", ""])
      expect(wrongId(typed, mine, table)).toContain("1 to 125");
  });
});

describe("the adapter that is chosen", () => {
  const adapter = (address: string, state: Adapter["state"]): Adapter => ({
    address,
    interface: "",
    channel: "",
    name: "",
    state,
    usable: state === "ready" || state === "connected",
    reason: null,
    remedy: null,
    cause: null,
    params: {},
    bitrate: null,
    sample_point: null,
    serial_number: null,
    baud: null,
  });
  const list = [
    adapter("a", "down"),
    adapter("b", "connected"),
    adapter("c", "ready"),
    adapter("d", "ready"),
  ];

  test("is the first that can be used and is not connected already", () => {
    expect(chosenOf(list, null)).toBe("c");
    expect(chosenOf(list.slice(0, 2), null)).toBe("b");
    expect(chosenOf(list.slice(0, 1), null)).toBeNull();
    expect(chosenOf([], null)).toBeNull();
  });

  test("stays while usable, and a typed address always stays", () => {
    expect(chosenOf(list, "d")).toBe("d");
    expect(chosenOf(list, "a")).toBe("c");
    expect(chosenOf(list, "gone")).toBe("c");
    expect(chosenOf([], "")).toBe("");
  });
});

describe("figures and names", () => {
  test.each([
    [0, "0"],
    [999, "999"],
    [1000, "1\u202f000"],
    [8_214_806, "8\u202f214\u202f806"],
    [-1234, "−1\u202f234"],
  ])("%d in groups", (value, shown) => {
    expect(grouped(value)).toBe(shown);
  });

  test.each([
    [640, "640\u202fB"],
    [1000, "1.00\u202fkB"],
    [12_345_678, "12.3\u202fMB"],
    [999_900, "1.00\u202fMB"],
    [100_000_000, "100\u202fMB"],
    [2_500_000_000, "2.50\u202fGB"],
  ])("%d bytes", (bytes, shown) => {
    expect(size(bytes)).toBe(shown);
  });

  test.each([
    ["socketcan:can0", "can0"],
    ["slcan:/dev/ttyACM0", "ttyACM0"],
    ["file:recording.log", "recording.log"],
    ["memory:demo", "demo"],
    ["virtual:", ""],
    [null, ""],
  ])("%s is called %s", (address, name) => {
    expect(channelOf(address)).toBe(name);
  });
});
