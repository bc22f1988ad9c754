/** The latched stop in words: confirmed servos, and those named because their state is unknown. */
import { render } from "preact";
import { act } from "preact/test-utils";
import { afterEach, beforeEach, expect, test } from "vitest";
import type { Finding, FindingCode } from "../api/bus-types";
import type { Stop } from "../api/types";
import { stop } from "../bench/bench";
import { doctor } from "../bench/doctor";
import { link } from "../bench/link";
import { Bands } from "./bands";

let host: HTMLElement;

beforeEach(() => {
  host = document.createElement("div");
  document.body.append(host);
  link.value = { state: "up", since: 0 };
  act(() => render(<Bands />, host));
});

afterEach(() => {
  act(() => render(null, host));
  host.remove();
  stop.value = null;
});

const latch = (change: Partial<Stop>) =>
  act(() => {
    const plain: Stop = {
      latched: true,
      mode: "off",
      at: 1,
      by: null,
      reason: null,
      servos: [],
      nodes: [],
      reach: "all",
      reaches: [],
    };
    stop.value = { ...plain, ...change };
  });
const band = () => host.querySelector('[data-testid="stop-band"]')?.textContent ?? "";

test("a servo that did not respond is named, with the remedy", () => {
  latch({
    servos: [
      { uid: "a".repeat(32), label: "Gripper", confirmed: true, ms: 4 },
      { uid: "b".repeat(32), label: "Rudder", confirmed: false, ms: null },
    ],
  });
  expect(band()).toContain("Torque is off on 1 of 2 servos.");
  expect(band()).toContain("Rudder did not respond: if it can move, cut its supply.");
});

test("a node that may be a servo counts and is named like one", () => {
  latch({
    servos: [{ uid: "a".repeat(32), label: "Gripper", confirmed: true, ms: 4 }],
    nodes: [{ node_id: 42, confirmed: false, ms: null }],
  });
  expect(band()).toContain("Torque is off on 1 of 2 servos.");
  expect(band()).toContain("Node 42 did not respond");
});

test("a failure of the server itself is shown on every page", () => {
  const found = (code: FindingCode, severity: Finding["severity"]): Finding => ({
    code,
    severity,
    text: "",
    evidence: "",
    remedy: null,
    node_ids: [],
    uids: [],
    advice: null,
    params: {},
  });
  const shown = (...list: Finding[]) => {
    act(() => {
      doctor.value.value = list;
    });
    return host.querySelector('[data-testid="server-band"]')?.textContent;
  };
  expect(shown(found("database", "ok"), found("disk_space", "warning"), found("bus_off", "failure"))).toBe(
    undefined,
  );
  expect(shown(found("database", "failure"))).toContain("Changes are not being stored");
  expect(shown()).toBe(undefined);
});
