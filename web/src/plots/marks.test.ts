/** Marks: which events and writes are shown in plots, and by which word. */
import { expect, test } from "vitest";
import type { AuditRow } from "../api/config-types";
import type { EventCode } from "../api/types";
import { markOfEvent, markOfRow } from "./marks";

const event = (code: EventCode) => ({ at: 5, level: "warning" as const, uid: "a", code, text: "" });
const row = (more: Partial<AuditRow>) =>
  ({
    id: 1,
    at: 7,
    by: "me",
    action: "write",
    outcome: "applied",
    uid: "a",
    key: "torque_mode",
    ...more,
  }) as AuditRow;

test("a fault is marked when it happened, a node id that was given is not", () => {
  expect(markOfEvent(event("fault"))).toEqual({ at: 5, uid: "a", word: "fault" });
  expect(markOfEvent(event("allocated"))).toBeNull();
});

test("a write is marked by the register, one that was refused says so", () => {
  const address = () => "0x20";
  expect(markOfRow(row({}), address)).toEqual({ at: 7, uid: "a", word: "write 0x20" });
  expect(markOfRow(row({ outcome: "refused" }), address)?.word).toBe("refused 0x20");
  expect(markOfRow(row({ action: "save", key: null }), address)?.word).toBe("save");
  expect(markOfRow(row({ action: "label" }), address)).toBeNull();
});
