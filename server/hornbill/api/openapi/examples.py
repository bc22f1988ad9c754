"""Examples of JSON request bodies; those of parameter values are generated in `rows`.

tests/contract/test_examples.py checks them against their routes, parameters and values.
"""

from typing import Any, Final

SERVO: Final = "00000000a1b2c3d400000000e5f60718"
SECOND: Final = "00000000a1b2c3d400000000e5f60719"
MODEL: Final = "BLA21-06U-A0"

PLAN: Final = {
    "program": "ardupilot",
    "outputs": [{"output": 1, "servo_id": 1, "label": "left aileron", "low_deg": -25.0, "high_deg": 25.0}],
}

EXAMPLES: Final[dict[str, dict[str, dict[str, Any]]]] = {
    # access
    "log_in": {"token": {"token": "hb_token-from-hornbill-token-create"}},
    "create_token": {"for a rig": {"name": "rig-7", "role": "configure"}},
    # the bus
    "connect_bus": {
        "SocketCAN": {"address": "socketcan:can0"},
        "serial adapter": {"address": "slcan:/dev/ttyACM0", "bitrate": 1_000_000},
    },
    "change_role": {"beside an autopilot": {"role": "guest"}},
    "export_autopilot_parameters": {"an aileron of ArduPilot": PLAN},
    "import_autopilot_parameters": {
        "ArduPilot": {"program": "ardupilot", "text": "CAN_D1_UC_SRV_BM,1\nSERVO1_MIN,1430\nSERVO1_MAX,1570\n"}
    },
    "begin_verification": {"an aileron of ArduPilot": PLAN},
    "begin_verification_step": {
        "all controls centred": {"kind": "neutral"},
        "one control fully positive": {"kind": "positive", "output": 1},
    },
    "set_allocator": {"allocate node IDs": {"mode": "on"}},
    "pin_allocation": {"node ID 42": {"node_id": 42}},
    "recycle_allocations": {"away for a day": {"idle_longer_than_s": 86_400}},
    "start_log": {"up to 50 MB": {"format": "candump", "limit_mb": 50}},
    # configuration
    "label_servo": {"nickname": {"label": "left elbow"}},
    "update_known_servo": {"nickname": {"label": "left elbow"}, "notes": {"notes": "New gears 2026-03-01."}},
    "change_parameters": {
        "two limits, then save": {"values": {"angle_limit_cw": 60.0, "angle_limit_ccw": -45.0}, "save": True},
        "dry run": {"values": {"smoothing": False, "timeout_action": "brake"}, "dry_run": True},
    },
    "change_matrix": {
        "two servos, all or none": {
            "servos": {SERVO: {"torque_limit_cw": 80, "torque_limit_ccw": -80}, SECOND: {"torque_limit_cw": 60}},
            "all_or_none": True,
        }
    },
    "set_parameter": {"P gain 60": {"value": 60}},
    "save_servo": {"default": {}, "torque off at every start": {"confirm": ["torque_off_in_rom"]}},
    "restart_servo": {"dry run": {"dry_run": True}},
    "factory_reset": {
        "keep identity": {"keep_identity": True},
        "dry run": {"keep_identity": True, "dry_run": True},
    },
    "set_position_unit": {"measure": {"unit": None}, "degrees": {"unit": "degree"}},
    "copy_configuration": {"from another servo": {"from": f"servo:{SECOND}", "dry_run": True}},
    "restore_drift": {"restore and save": {"save": True}},
    "take_snapshot": {"with a reason": {"reason": "before tuning"}},
    "restore_snapshot": {"two rows": {"keys": ["angle_p_gain", "angle_d_gain"], "source": "ram"}},
    "put_profile": {
        "values": {"description": "soft hand", "model": MODEL, "values": {"torque_limit_cw": 40}},
        "from a servo": {"from_uid": SERVO},
    },
    "apply_profile": {"two servos, then save": {"uids": [SERVO, SECOND], "save": True}},
    "commission": {
        "two new servos": {
            "servos": [
                {"uid": SERVO, "servo_id": 1, "node_id": 11, "label": "left elbow"},
                {"uid": SECOND, "servo_id": 2, "node_id": 12, "label": "right elbow"},
            ],
            "identify": True,
        }
    },
    # motion
    "take_lease": {"for a test rig": {"holder": "rig 7", "ttl_s": 3.0}},
    "request_lease": {"with a reason": {"holder": "Aki", "reason": "replacing the horn", "timeout_s": 10}},
    "command_servo": {
        "angle, wait until settled": {"type": "angle", "value": 30.0, "wait": "settled", "timeout_s": 5.0},
        "speed": {"type": "speed", "value": 20},
    },
    "command_servos": {
        "two servos": {
            "commands": [
                {"uid": SERVO, "type": "angle", "value": 30.0},
                {"uid": SECOND, "type": "angle", "value": -30.0},
            ]
        }
    },
    "set_torque": {"torque off": {"mode": "off"}},
    "stop": {"torque off": {}, "brake": {"mode": "brake", "reason": "a finger in the way"}},
    "restore_output": {
        "dry run": {"dry_run": True},
        "all servos that were on": {},
        "one servo under load": {"uids": [SERVO], "confirm": ["load"]},
    },
    "start_stream": {"angles at 50 Hz": {"uids": [SERVO, SECOND], "type": "angle", "rate_hz": 50}},
    "set_stream_values": {"new setpoints": {"values": {SERVO: 12.5, SECOND: -12.5}}},
    "run_plan": {
        "dry run of an endurance test": {
            "plan": {
                "name": "endurance",
                "servos": ["61-466861"],
                "cycles": 1000,
                "limits": {"position_error_deg": 2.0, "temperature_c": 75},
                "stop": {"on_limit": "stop"},
                "steps": [
                    {"do": "move", "angle_deg": 30},
                    {"do": "wait", "for_s": 0.5},
                    {"do": "move", "angle_deg": -30, "speed_deg_s": 90},
                ],
            },
            "dry_run": True,
        },
    },
    "step_test": {"10 degrees, 3 runs": {"step_deg": 10.0, "runs": 3}},
    "measure_mechanics": {
        "friction and end stops": {"tests": ["friction", "end_stops"], "from_deg": -60.0, "to_deg": 60.0}
    },
    "measure_frequency_response": {
        "0.5 to 20 Hz": {"amplitude_deg": 2.0, "duration_s": 20.0},
        "multisine at three amplitudes": {"excitation": "multisine", "amplitude_deg": 2.0, "ladder": True},
    },
    "plan_improve": {"calm": {"goal": "calm", "bounds": {"from_deg": -15.0, "to_deg": 15.0}}},
    "improve_servo": {
        "calm": {"goal": "calm"},
        "fast within bounds": {
            "goal": "fast",
            "bounds": {"from_deg": -10.0, "to_deg": 10.0, "torque_pct": 60, "speed_rpm": 60, "time_s": 90},
        },
    },
    "improve_servos": {"two alike": {"uids": [SERVO, SECOND], "goal": "stiff"}},
    "put_set_up": {
        "arm in a vice": {"arm_mm": 60.0, "mass_g": 120.0, "mounting": "vice", "supply_v": 7.4, "ambient_c": 24.0}
    },
    # telemetry and recordings
    "set_telemetry": {
        "for one minute": {
            "channels": ["current_angle", "current_torque"], "rate_hz": 50, "owner": "rig 7", "ttl_s": 60
        },
    },
    "create_recording": {"last 30 seconds": {"before_s": 30, "reason": "It clicked."}},
    # simulator
    "add_sim_autopilot": {"ArduPilot": {"program": "ardupilot", "output_count": 4}},
    "change_sim_autopilot": {
        "arm, safety switch off": {"armed": True, "safety_on": False},
        "output 1 fully positive": {"sweep": False, "outputs": [{"output": 1, "demand": 1.0}]},
    },
    "set_sim_clock": {"a hundred times faster": {"speed": 100}},
    "start_sim_chaos": {"supply and load": {"seed": 7, "kinds": ["power_cut", "load"], "interval_s": 5.0}},
    "add_sim_servo": {"new servo": {"model": MODEL, "firmware": "1.300", "angle_deg": 15.0}},
    "change_sim_servo": {
        "hot and loaded": {"temperature_c": 60.0, "load_pct": 30.0},
        "worn gear on an arm with end stops": {
            "plant": {"inertia": 3.0, "backlash_deg": 0.6, "stop_ccw_deg": -60.0, "stop_cw_deg": 60.0}
        },
        "power off": {"power": "off"},
    },
}  # fmt: skip
"""By operation ID: bodies by a short description."""


def show(made: dict[str, Any]) -> None:
    """Add the examples to an OpenAPI document."""
    for verbs in made["paths"].values():
        for operation in verbs.values():
            found = EXAMPLES.get(operation["operationId"])
            if found:
                content = operation["requestBody"]["content"]["application/json"]
                content["examples"] = {
                    words.replace(" ", "_").replace(",", ""): {"summary": words, "value": body}
                    for words, body in found.items()
                }
