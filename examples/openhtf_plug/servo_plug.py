"""Servo as a test-station plug: set up before the phases, torn down after them in every case.

It does not import OpenHTF. OpenHTF creates plugs without arguments and calls only `tearDown`, so wrap it there:

    class Servo(openhtf.plugs.BasePlug):
        def __init__(self) -> None:
            self._plug = ServoPlug("61-466861")
            self._plug.setUp()
            self.settle_s = self._plug.settle_s

        def tearDown(self) -> None:
            self._plug.tearDown()
"""

from contextlib import ExitStack

from hornbill.client import Hornbill, Servo


class ServoPlug:
    """Lease and torque on one servo for the duration of a test. Torque is off before and after."""

    def __init__(self, serial: str) -> None:
        """`serial`: as shown by 'hornbill list'. HORNBILL_URL selects the server."""
        self._serial = serial
        self._open = ExitStack()
        self.servo: Servo

    def setUp(self) -> None:
        """Take motion control and turn torque on at the present angle."""
        with ExitStack() as begun:
            hornbill = begun.enter_context(Hornbill(by="test station"))
            self.servo = hornbill.find(serial=self._serial)
            begun.enter_context(hornbill.lease("test station"))
            self.servo.torque("on")
            self._open = begun.pop_all()

    def tearDown(self) -> None:
        """Release motion control, which turns torque off. Idempotent."""
        self._open.close()

    def settle_s(self, angle_deg: float) -> float:
        """Settling time at an angle, s. Raises DidNotMove after 5 s."""
        return self.servo.move(angle_deg)["settle_time_s"] or 0.0
