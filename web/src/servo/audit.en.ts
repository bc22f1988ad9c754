/** The English words for what hornbill keeps by code: why a snapshot was taken, what was done, what came of it. */
import type { Facts } from "../bench/facts";

export const words = {
  reasons: {
    by_hand: () => "Taken by hand",
    saving: () => "Before a save to ROM",
    factory_reset: () => "Before a factory reset",
    drift_undone: () => "Before changes from outside were undone",
    change: (p: Facts) =>
      p.more === undefined || p.more === "0"
        ? `Before a change of ${p.key}`
        : `Before a change of ${p.key} and ${p.more} more`,
    commissioning: () => "Before commissioning",
    matrix: () => "Before a change of several servos",
    profile: (p: Facts) => `Before the profile ${p.profile}`,
    restore: (p: Facts) =>
      p.snapshot === undefined
        ? `Before a restore of ${p.side}`
        : `Before snapshot ${p.snapshot} was restored`,
  },

  words: {
    write: "Write",
    torque: "Torque",
    save: "Save",
    restart: "Restart",
    factory_reset: "Factory reset",
    snapshot: "Snapshot",
    profile: "Profile",
    commissioning: "Commissioning",
    identify: "Wiggle",
    drift: "Change outside",
    label: "Label",
    notes: "Notes",
    position_unit: "Position unit",
    lease: "Motion control",
    stop: "Stop",
    acknowledge: "Acknowledge",
    pin: "Pin a node ID",
    forget: "Forget",
    allocator: "Node ID allocator",
    step_test: "Step test",
    restore_output: "Restore output",
    applied: "applied",
    succeeded: "done",
    verified: "verified",
    unchanged: "unchanged",
    accepted: "accepted",
    cancelled: "stopped",
    failed: "failed",
    refused: "refused",
    no_response: "no answer",
    clamped: "held by the servo",
    rolled_back: "undone",
    dropped: "dropped",
    cleared: "cleared",
    pressed: "pressed",
    taken: "taken",
    handed: "handed over",
    passed: "passed on",
    released: "given back",
    lapsed: "ran out",
  } as Record<string, string>,
};
