"""Test station with the plug: set up, measure within limits, tear down. Prints a record."""

import json
import sys

from servo_plug import ServoPlug

LIMITS = {"settle_20_deg_s": 1.0, "settle_0_deg_s": 1.0}


def main(serial: str) -> int:
    """Return exit code 0 if every measurement is within its limit."""
    plug = ServoPlug(serial)
    measured: dict[str, float] = {}
    try:
        plug.setUp()
        measured["settle_20_deg_s"] = plug.settle_s(20)
        measured["settle_0_deg_s"] = plug.settle_s(0)
    finally:
        plug.tearDown()
    passed = all(measured[name] <= limit for name, limit in LIMITS.items())
    print(json.dumps({"serial": serial, "outcome": "PASS" if passed else "FAIL", "measurements": measured}))
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
