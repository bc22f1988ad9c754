"""Test station with OpenHTF: measure within limits, and write the record as JSON. Exit code 0 if the servo passed."""

import sys

import openhtf as htf
from openhtf.output.callbacks import console_summary, json_factory
from openhtf.util import units
from servo_plug import CONF, ServoPlug


@htf.plug(servo=ServoPlug)
@htf.measures(
    htf.Measurement("settle_20_deg_s").in_range(0, 1).with_units(units.SECOND),
    htf.Measurement("settle_0_deg_s").in_range(0, 1).with_units(units.SECOND),
)
def step(test: htf.TestApi, servo: ServoPlug) -> None:
    """Move to 20° and back."""
    test.measurements.settle_20_deg_s = servo.settle_s(20)
    test.measurements.settle_0_deg_s = servo.settle_s(0)


def main(serial: str) -> int:
    """Test one servo."""
    CONF.load(servo_serial=serial)
    test = htf.Test(step, test_name="servo step")
    test.add_output_callbacks(console_summary.ConsoleSummary(), json_factory.OutputToJSON("{dut_id}.json", indent=2))
    return 0 if test.execute(test_start=lambda: serial) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
