/** Tests the draft of the wizard: proposals, errors, requests, and that any stored draft can be read. */
import { describe, expect, it } from "vitest";
import type { Candidate } from "../api/config-types";
import {
  chooseServos,
  count,
  EMPTY,
  nextOpen,
  propose,
  read,
  request,
  type WizardDraft,
  wrongIds,
} from "./draft";

const A = "a".repeat(32);
const B = "b".repeat(32);
const C = "c".repeat(32);

const candidate = (uid: string, servo_id: number | null) => ({ servo: { uid }, servo_id }) as Candidate;

function draftOf(entries: WizardDraft["entries"], free: number[] = [7, 8, 9]): WizardDraft {
  return { ...EMPTY, step: "identify", chosen: Object.keys(entries), entries, free };
}

const entry = (servoId: string, state: "open" | "given" | "skipped" = "open", nodeId = "", label = "") => ({
  servoId,
  nodeId,
  label,
  state,
});

describe("choosing", () => {
  it("keeps what was typed, and points at the first that is open", () => {
    const before = draftOf({ [A]: entry("7", "given", "", "Rudder") });
    const part = chooseServos(
      before,
      [
        { uid: A, servoId: 0, label: "" },
        { uid: B, servoId: 0, label: "" },
      ],
      [candidate(A, 7), candidate(B, 8)],
    );
    expect(part.entries?.[A]?.label).toBe("Rudder");
    expect(part.at).toBe(B);
    expect(part.free).toEqual([7, 8]);
  });

  it("offers a servo that has an id its own", () => {
    expect(chooseServos(EMPTY, [{ uid: C, servoId: 12, label: "Winch" }], []).entries?.[C]).toEqual(
      entry("12", "open", "", "Winch"),
    );
  });

  it("forgets servos that are no longer selected", () => {
    const before = draftOf({ [A]: entry("7", "given") });
    expect(chooseServos(before, [], []).entries).toEqual({});
  });
});

describe("the proposal", () => {
  it("is the lowest free id in the order of identifying, not of the list", () => {
    const draft = draftOf({ [A]: entry(""), [B]: entry("7", "given"), [C]: entry("") });
    expect(propose(draft, C, new Set())).toBe("8");
  });

  it("goes on past what the server offered, and around ids of others", () => {
    const draft = draftOf({ [A]: entry("1", "given"), [B]: entry("") }, [1]);
    expect(propose(draft, B, new Set([2]))).toBe("3");
  });

  it("is nothing when every id is taken", () => {
    const all = new Set(Array.from({ length: 254 }, (_, i) => i + 1));
    expect(propose(draftOf({ [A]: entry("") }, []), A, all)).toBe("");
  });
});

describe("what is wrong with an id", () => {
  const owners = new Map([[5, "Winch"]]);
  const wrong = (typed: string, node = "") => {
    const draft = draftOf({ [A]: entry(typed, "open", node), [B]: entry("7", "given", "20") });
    return wrongIds(draft, A, owners);
  };

  it("is nothing for a free one", () => expect(wrong("8")).toEqual({ servoId: null, nodeId: null }));
  it("is that it is out of range", () => {
    expect(wrong("0").servoId).toContain("1 to 254");
    expect(wrong("255").servoId).toContain("255");
    expect(wrong("").servoId).toContain("Enter");
    expect(wrong("1e2").servoId).not.toBeNull();
  });
  it("is that another of the list has it", () => expect(wrong("7").servoId).toContain("another servo"));
  it("is whose it is", () => expect(wrong("5").servoId).toContain("Winch"));
  it("is a node id given twice or out of range; 0 and nothing are right", () => {
    expect(wrong("8", "20").nodeId).toContain("another servo");
    expect(wrong("8", "126").nodeId).toContain("126");
    expect(wrong("8", "0").nodeId).toBeNull();
    expect(wrong("8", " ").nodeId).toBeNull();
  });
});

describe("requests", () => {
  const draft: WizardDraft = {
    ...draftOf({
      [A]: entry("7", "given", "", " Rudder "),
      [B]: entry("8", "skipped"),
      [C]: entry("9", "given", "30"),
    }),
    profile: "tail",
    onAnomaly: "continue",
  };

  it("leaves out the skipped and trims names", () => {
    expect(request(draft)).toEqual({
      servos: [
        { uid: A, servo_id: 7, node_id: null, label: "Rudder" },
        { uid: C, servo_id: 9, node_id: 30, label: "" },
      ],
      profile: "tail",
      save: true,
      identify: false,
      on_anomaly: "continue",
      confirm: [],
    });
  });

  it("is one servo alone when it is done again", () => {
    expect(request(draft, [C]).servos.map(one => one.uid)).toEqual([C]);
  });

  it("is counted", () => expect(count(draft)).toEqual({ given: 2, skipped: 1, open: 0 }));
});

it("goes round the list for the next open one", () => {
  const draft = draftOf({ [A]: entry(""), [B]: entry("7", "given"), [C]: entry("", "skipped") });
  expect(nextOpen(draft, B)).toBe(A);
  expect(nextOpen(draftOf({ [B]: entry("7", "given") }), B)).toBeNull();
});

describe("reading what was kept", () => {
  it("gives back what was written", () => {
    const draft = draftOf({ [A]: entry("7", "given") });
    expect(read(JSON.parse(JSON.stringify(draft)))).toEqual(draft);
  });
  it("starts empty from anything else", () => {
    for (const kept of [
      null,
      "",
      5,
      [],
      { step: "fly", chosen: [] },
      { step: "find", chosen: [A] },
      { step: "find", chosen: [A], entries: 5 },
    ])
      expect(read(kept)).toEqual(EMPTY);
  });
});
