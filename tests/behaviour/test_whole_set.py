"""All parameters of a servo: the fast encoding has the content of the model."""

import re

from behaviour.rig import Recipe, Rig
from behaviour.scene import scene
from hornbill.api.routes.configuration.parameters import Parameters
from hornbill.servo.device.reading import readings
from hornbill.servo.device.servo import Servo

AGES = re.compile(rb'"(at|age_s)":[^,]*')


@scene(Recipe("BLA21-06U-AB", "1.300", servo_id=1, node_id=11, rom={"pwm_mode": 1}))
async def test_the_fast_encoding_of_all_parameters_is_that_of_their_readings(rig: Rig, servo: Servo) -> None:
    typed = await rig.call("GET", f"/servos/{servo.uid}/parameters")
    plain = Parameters(revision=servo.revision, parameters=readings(servo, rig.host.base))
    assert AGES.sub(b"", typed.content) == AGES.sub(b"", plain.model_dump_json().encode())
