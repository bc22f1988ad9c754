/** English words for stored codes: reasons of snapshots, and actions and outcomes of the audit. */
import type { Facts } from "../bench/facts";

export const words = {
  reasons: {
    manual: () => "Taken manually",
    saving: () => "Before a save to ROM",
    factory_reset: () => "Before a factory reset",
    drift_undone: () => "Before external changes were undone",
    change: (p: Facts) =>
      p.more === undefined || p.more === "0"
        ? `Before changing ${p.key}`
        : `Before changing ${p.key} and ${p.more} more`,
    commissioning: () => "Before commissioning",
    matrix: () => "Before changing several servos",
    profile: (p: Facts) => `Before applying profile ${p.profile}`,
    restore: (p: Facts) =>
      p.snapshot === undefined ? `Before restoring ${p.side}` : `Before restoring snapshot ${p.snapshot}`,
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
    drift: "External change",
    label: "Label",
    notes: "Notes",
    set_up: "Set-up",
    position_unit: "Position unit",
    lease: "Motion control",
    stop: "Stop",
    acknowledge: "Acknowledge",
    pin: "Pin node ID",
    forget: "Forget",
    allocator: "Node ID allocator",
    step_test: "Step test",
    restore_output: "Restore output",
    applied: "applied",
    succeeded: "done",
    verified: "verified",
    unchanged: "unchanged",
    accepted: "accepted",
    cancelled: "cancelled",
    failed: "failed",
    refused: "refused",
    no_response: "no response",
    clamped: "limited by the servo",
    rolled_back: "undone",
    dropped: "dropped",
    cleared: "cleared",
    pressed: "pressed",
    taken: "taken",
    handed: "handed over",
    passed: "passed on",
    released: "released",
    expired: "expired",
  } as Record<string, string>,
};
