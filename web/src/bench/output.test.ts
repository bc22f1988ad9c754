/** What is said of an output: state, reason, who and when; and what a session may give back. */
import { beforeEach, describe, expect, test, vi } from "vitest";
import { minute } from "./format";
import { holder } from "./holder";
import { type Output, outputLine, switchedOff } from "./output";

const NOW = Date.UTC(2026, 10, 22, 14, 3) / 1000;

beforeEach(() => {
  vi.spyOn(Date, "now").mockReturnValue(NOW * 1000);
});

const output = (more: Partial<Output>): Output => ({
  state: "off",
  reason: "stop",
  by: null,
  since: null,
  ...more,
});

describe("outputLine", () => {
  test.each<[Partial<Output>, string]>([
    [{ state: "on", reason: "command", by: "Rig 3" }, "Output on"],
    [{ state: "unknown", reason: "stop", by: "Rig 3" }, "Output unknown"],
    [{}, "Output off: stopped"],
    [{ by: "Rig 3" }, "Output off: stopped by Rig 3"],
    [{ reason: "lease", by: "Rig 3" }, "Output off: motion control of Rig 3 ended"],
    [{ reason: "command" }, "Output off: switched by another tool"],
    [{ reason: "command", by: "no lease" }, "Output off: switched by a client"],
    [{ state: "brake", reason: "command", by: "Rig 3" }, "Brake on: switched by Rig 3"],
    [{ reason: "timeout" }, "Output off: command timeout (0x26)"],
    [{ reason: "configured" }, "Output off: as configured"],
  ])("%j: %s", (more, line) => {
    expect(outputLine(output(more))).toBe(line);
  });

  test("this page is you, and the time is that of the day, with the date when it was another one", () => {
    const mine = output({ by: holder(), since: NOW - 60 });
    expect(outputLine(mine)).toBe(`Output off: stopped by you, ${minute(NOW - 60)}`);
    expect(outputLine({ ...mine, reason: "lease" })).toContain("your motion control ended, ");
    expect(outputLine({ ...mine, since: NOW - 3 * 86_400 })).toMatch(/by you, 2026-11-\d\d \d\d:\d\d$/);
  });
});

test.each<[Partial<Output>, boolean]>([
  [{}, true],
  [{ state: "brake", reason: "lease" }, true],
  [{ reason: "command" }, true],
  [{ reason: "configured" }, false],
  [{ reason: "timeout" }, false],
  [{ reason: "protection" }, false],
  [{ state: "on" }, false],
  [{ state: "unknown" }, false],
])("a session switched %j off: %s", (more, expected) => {
  expect(switchedOff(output(more))).toBe(expected);
});
