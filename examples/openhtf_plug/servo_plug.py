"""A servo as a plug: made for a phase, set up before it, torn down after it, whatever happened in between.

It needs nothing of OpenHTF, only its way of working: derive from `openhtf.plugs.BasePlug` as well, and it is one.
"""

from contextlib import ExitStack

from hornbill.client import Hornbill, Servo


class ServoPlug:
    """Motion control of one servo for the length of a test; torque is off before and after."""

    def __init__(self, serial: str) -> None:
        """`serial` as 'hornbill list' shows it; the server is that of HORNBILL_URL."""
        self._serial = serial
        self._open = ExitStack()
        self.servo: Servo

    def setUp(self) -> None:
        """Take motion control, and turn torque on where the horn stands."""
        with ExitStack() as begun:
            hornbill = begun.enter_context(Hornbill(by="test station"))
            self.servo = hornbill.find(serial=self._serial)
            begun.enter_context(hornbill.lease("test station"))
            self.servo.torque("on")
            self._open = begun.pop_all()

    def tearDown(self) -> None:
        """Give motion control back, which turns torque off; safe to call twice."""
        self._open.close()

    def settle_s(self, angle_deg: float) -> float:
        """Seconds until the horn rests at an angle. Raises DidNotMove when it does not within 5 s."""
        return self.servo.move(angle_deg)["settle_time_s"] or 0.0
