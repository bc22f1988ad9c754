/** The dialog of a save: a bar that is full when the job is over, whatever the job took. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test } from "vitest";
import type { Job } from "../api/types";
import { jobs } from "../bench/jobs";
import { ChangeDialog } from "./dialog";
import { ChangeFlow, shownChange } from "./flow";

const UID = "9".repeat(32);
const root = document.createElement("div");

const job = (state: Job["state"], took: number | null) =>
  ({
    id: "s",
    uid: UID,
    kind: "save",
    state,
    steps: [
      {
        name: "check",
        text: "RAM read",
        state: "done",
        evidence: "30 rows read. Support it.",
        ahead: "Support it.",
      },
    ],
    created_at: 100,
    ended_at: took === null ? null : 100 + took,
    error: null,
  }) as unknown as Job;

beforeEach(() => {
  document.body.append(root);
  const flow = new ChangeFlow({ kind: "save", save: "always", run: async () => undefined });
  flow.phase.value = "running";
  flow.turns.value = [
    { uid: UID, state: "running", job: "s", count: 0, saved: false, fault: null, why: null },
  ];
  shownChange.value = flow;
});

afterEach(() => {
  act(() => render(null, root));
  root.remove();
  shownChange.value = null;
  jobs.value = new Map();
});

function show(one: Job): { end: number; text: string } {
  jobs.value = new Map([["s", one]]);
  if (shownChange.value && one.state !== "running") shownChange.value.phase.value = "over";
  act(() => render(<ChangeDialog />, root));
  const bar = root.querySelector("[data-testid=time-bar]")?.getAttribute("d") ?? "";
  return { end: Number(bar.split("H")[1]), text: root.textContent ?? "" };
}

test("while it runs the bar grows on the usual time, and what is ahead is said", () => {
  const { end, text } = show(job("running", null));
  expect(end).toBeLessThan(630);
  expect(text).toContain("Support it.");
});

test.each(["succeeded", "failed"] as const)(
  "a job that %s fills its scale, which ends where it did",
  state => {
    const { end, text } = show(job(state, 1.8));
    expect(end).toBe(630);
    expect(text).toContain("1.8\u202fs");
    expect(text).not.toContain("3\u202fs");
    expect(text).not.toContain("Support it.");
  },
);
