"""Constants of a plant from a file: unknown names, values out of range, contradictions."""

import pytest

from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants, plant_from
from hornbill.errors import InvalidValue


def test_omitted_constants_have_their_defaults() -> None:
    assert plant_from({}) == DEFAULT_PLANT
    assert plant_from({"inertia": 3, "load_by_angle": [[-10, 5], [10, -5.5]]}) == PlantConstants(
        inertia=3.0, load_by_angle=((-10.0, 5.0), (10.0, -5.5))
    )


@pytest.mark.parametrize(
    ("document", "text"),
    [
        ({"inertja": 1}, "Unknown plant constant 'inertja'. Did you mean inertia?"),
        ({"xyz": 1}, "Known: inertia, breakaway,"),
        ({"inertia": -1}, "inertia -1 is below its limit. Enter at least 0."),
        ({"backlash_deg": 11}, "backlash_deg 11 is above its limit. Enter at most 10."),
        ({"inertia": "heavy"}, "inertia 'heavy' is not valid"),
        ({"inertia": float("nan")}, "inertia"),
        ({"coulomb": 0.1, "breakaway": 0.05}, "coulomb 0.1 is above breakaway, 0.05."),
        ({"stop_cw_deg": -5, "stop_ccw_deg": 5}, "stop_ccw_deg 5 is not below stop_cw_deg, -5."),
        ({"load_by_angle": [[10, 0], [-10, 0]]}, "The angles of load_by_angle do not increase."),
        ({"load_by_angle": [[10, 5000]]}, "load_by_angle.0.1 5000 is above its limit. Enter at most 1000."),
    ],
)
def test_an_invalid_file_is_refused_with_its_reason(document: dict[str, object], text: str) -> None:
    with pytest.raises(InvalidValue) as refused:
        plant_from(document)
    assert text in refused.value.detail
