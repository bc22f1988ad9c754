"""Servo as a plug of OpenHTF: torque on before the first phase that uses it, off at the end of the test in every case.

OpenHTF creates a plug without arguments, once per test, and calls `tearDown` at its end, also after a failure.
"""

from contextlib import ExitStack

from openhtf.plugs import BasePlug
from openhtf.util import configuration

from hornbill.client import Hornbill

CONF = configuration.CONF
CONF.declare("servo_serial", description="Serial number of the servo under test, as shown by 'hornbill list'.")


class ServoPlug(BasePlug):
    """Lease and torque on one servo for the duration of a test. HORNBILL_URL selects the server.

    The lease is renewed in the background, also while a phase waits for an operator. `servo`: client of the servo.
    """

    def __init__(self) -> None:
        """Take motion control and turn torque on at the present angle. An error ends the test, with torque off."""
        super().__init__()
        with ExitStack() as begun:
            hornbill = begun.enter_context(Hornbill(by="test station"))
            self.servo = hornbill.find(serial=CONF.servo_serial)
            begun.enter_context(hornbill.lease("test station", uids=[self.servo.uid]))
            self.servo.torque("on")
            self._open = begun.pop_all()

    def tearDown(self) -> None:
        """Release motion control, which turns torque off. Raises LeaseRequired if it was lost before."""
        self._open.close()

    def settle_s(self, angle_deg: float) -> float:
        """Settling time at an angle, s. Raises DidNotMove after 5 s."""
        return self.servo.move(angle_deg)["settle_time_s"] or 0.0
