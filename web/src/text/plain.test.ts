/** What the server tells programs is not read out to people; what it tells people is, word for word. */
import { expect, test } from "vitest";
import { plain } from "./plain";

test.each([
  [
    "Lower voltage limit 7.2 V could switch the output off here and now: supply voltage is 7.4 V (±0.3 V) now. " +
      'Enter at most 7.1 V, or send it again with confirm: ["supply"].',
    "Lower voltage limit 7.2 V could switch the output off here and now: supply voltage is 7.4 V (±0.3 V) now. " +
      "Enter at most 7.1 V.",
  ],
  [
    'A would turn 2.0 times clockwise to reach 720°: it goes all of them (4.17). To do it, send it again with confirm: ["turns"].',
    "A would turn 2.0 times clockwise to reach 720°: it goes all of them (4.17).",
  ],
  ['A limit is near. Send it again with confirm: ["supply"].', "A limit is near."],
  ["There is no log 'a_b.asc'. GET /api/v1/bus/logs lists them.", "There is no log 'a_b.asc'."],
  [
    "a_b.asc is being written. Stop it first: DELETE /api/v1/bus/log.",
    "a_b.asc is being written. Stop it first.",
  ],
  [
    "Motion needs a live lease. POST /api/v1/leases, then send its id in the header 'Lease'.",
    "Motion needs a live lease.",
  ],
  [
    "So it is not moved. Restore a snapshot (POST /api/v1/servos/ab/snapshots/1/restore) and save, or save what it holds now.",
    "So it is not moved. Restore a snapshot and save, or save what it holds now.",
  ],
  [
    "A and B share servo id 3: both would move. Give each its own (parameter servo_id), or command it by itself: POST /api/v1/servos/ab/command.",
    "A and B share servo id 3: both would move. Give each its own, or command it by itself.",
  ],
  [
    'Torque is off on A, so it would not move. Turn it on first: POST /api/v1/servos/ab/torque {"mode": "on"}.',
    "Torque is off on A, so it would not move. Turn it on first.",
  ],
  [
    "This servo never showed a fault x. GET …/faults lists those it did.",
    "This servo never showed a fault x.",
  ],
  ["End another stream, or poll less (PUT …/telemetry).", "End another stream, or poll less."],
  [
    "A node ID is in use by another servo of this request, which leaves it only when it is saved. Ask with save: true.",
    "A node ID is in use by another servo of this request, which leaves it only when it is saved.",
  ],
])("%s", (told, wanted) => expect(plain(told)).toBe(wanted));

test.each([
  "Node ID 5 belongs to Elevator L (in ROM). 7 is free.",
  "Set it up with: sudo ip link set can0 up type can bitrate 1000000",
  "Angle limit CW 92.05° is between two steps. Take 92.0° or 92.1°.",
  "GET /api/v1/servos",
])("%s stays as it is", told => expect(plain(told)).toBe(told));
