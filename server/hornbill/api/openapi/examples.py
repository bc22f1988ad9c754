"""An example or two of each body in JSON that a program may send; those of a row's value are made in `rows`.

tests/contract/test_examples.py holds that each is what its route takes, and names only rows and values that exist.
"""

from typing import Any, Final

SERVO: Final = "00000000a1b2c3d400000000e5f60718"
SECOND: Final = "00000000a1b2c3d400000000e5f60719"
MODEL: Final = "BLA21-06U-A0"

EXAMPLES: Final[dict[str, dict[str, dict[str, Any]]]] = {
    # access
    "log_in": {"as it was printed": {"token": "hb_a-token-of-hornbill-token-add"}},
    "create_token": {"for a rig": {"name": "rig-7", "role": "configure"}},
    # the bus
    "connect_bus": {
        "SocketCAN": {"address": "socketcan:can0"},
        "a serial adapter": {"address": "slcan:/dev/ttyACM0", "bitrate": 1_000_000},
    },
    "set_allocator": {"give node ids": {"mode": "on"}},
    "pin_allocation": {"node id 42": {"node_id": 42}},
    "recycle_allocations": {"away for a day": {"idle_longer_than_s": 86_400}},
    "start_log": {"up to 50 MB": {"format": "candump", "limit_mb": 50}},
    # configuration
    "label_servo": {"a nickname": {"label": "left elbow"}},
    "update_known_servo": {"a nickname": {"label": "left elbow"}, "notes": {"notes": "New gears 2026-03-01."}},
    "change_parameters": {
        "two limits, and save": {"values": {"angle_limit_cw": 60.0, "angle_limit_ccw": -45.0}, "save": True},
        "only look": {"values": {"smoothing": False, "timeout_action": "brake"}, "dry_run": True},
    },
    "change_matrix": {
        "two servos, all or none": {
            "servos": {SERVO: {"torque_limit_cw": 80, "torque_limit_ccw": -80}, SECOND: {"torque_limit_cw": 60}},
            "all_or_none": True,
        }
    },
    "set_parameter": {"60 as the P gain": {"value": 60}},
    "save_servo": {"as it is": {}, "with torque off at every start": {"confirm": ["torque_off_in_rom"]}},
    "restart_servo": {"only look": {"dry_run": True}},
    "factory_reset": {
        "it stays who it is": {"keep_identity": True},
        "only look": {"keep_identity": True, "dry_run": True},
    },
    "set_position_unit": {"measure it": {"unit": None}, "degrees": {"unit": "degree"}},
    "copy_configuration": {"from a neighbour": {"from": f"servo:{SECOND}", "dry_run": True}},
    "restore_drift": {"and save": {"save": True}},
    "take_snapshot": {"with a reason": {"reason": "before tuning"}},
    "restore_snapshot": {"two rows of it": {"keys": ["angle_p_gain", "angle_d_gain"], "source": "ram"}},
    "put_profile": {
        "by its values": {"description": "soft hand", "model": MODEL, "values": {"torque_limit_cw": 40}},
        "as a servo is": {"from_uid": SERVO},
    },
    "apply_profile": {"to two, and save": {"uids": [SERVO, SECOND], "save": True}},
    "commission": {
        "two new ones": {
            "servos": [
                {"uid": SERVO, "servo_id": 1, "node_id": 11, "label": "left elbow"},
                {"uid": SECOND, "servo_id": 2, "node_id": 12, "label": "right elbow"},
            ],
            "identify": True,
        }
    },
    # motion
    "take_lease": {"for a rig": {"holder": "rig 7", "ttl_s": 3.0}},
    "request_lease": {"with a reason": {"holder": "Aki", "reason": "the horn has to come off", "timeout_s": 10}},
    "command_servo": {
        "an angle, until it is there": {"type": "angle", "value": 30.0, "wait": "settled", "timeout_s": 5.0},
        "a speed": {"type": "speed", "value": 20},
    },
    "command_servos": {
        "two at once": {
            "commands": [
                {"uid": SERVO, "type": "angle", "value": 30.0},
                {"uid": SECOND, "type": "angle", "value": -30.0},
            ]
        }
    },
    "set_torque": {"let go": {"mode": "off"}},
    "stop": {"let go": {}, "brake": {"mode": "brake", "reason": "a finger in the way"}},
    "restore_output": {
        "only look": {"dry_run": True},
        "all that were on": {},
        "one, under load": {"uids": [SERVO], "confirm": ["load"]},
    },
    "start_stream": {"angles, 50 times a second": {"uids": [SERVO, SECOND], "type": "angle", "rate_hz": 50}},
    "set_stream_values": {"new setpoints": {"values": {SERVO: 12.5, SECOND: -12.5}}},
    "step_test": {"ten degrees, thrice": {"step_deg": 10.0, "runs": 3}},
    # what was and is
    "set_telemetry": {
        "for a minute": {
            "channels": ["current_angle", "current_torque"], "rate_hz": 50, "owner": "rig 7", "ttl_s": 60
        },
    },
    "create_recording": {"the last half minute": {"before_s": 30, "reason": "It clicked."}},
    # the bench of the simulator
    "add_sim_servo": {"a new one": {"model": MODEL, "firmware": "1.300", "angle_deg": 15.0}},
    "change_sim_servo": {"hot, and loaded": {"temperature_c": 60.0, "load_pct": 30.0}, "no power": {"power": "off"}},
}  # fmt: skip
"""By operation: what is in it in a few words, and the body."""


def show(made: dict[str, Any]) -> None:
    """Put the examples into an OpenAPI document."""
    for verbs in made["paths"].values():
        for operation in verbs.values():
            found = EXAMPLES.get(operation["operationId"])
            if found:
                content = operation["requestBody"]["content"]["application/json"]
                content["examples"] = {
                    words.replace(" ", "_").replace(",", ""): {"summary": words, "value": body}
                    for words, body in found.items()
                }
