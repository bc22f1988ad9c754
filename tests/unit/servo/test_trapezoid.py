"""The trapezoid profile: within its speed and acceleration, and exact at the target."""

from hypothesis import given
from hypothesis import strategies as some

from hornbill.servo.motion.jogs import PERIOD_S
from hornbill.servo.motion.trapezoid import Track, TrapezoidProfile

PROFILES = some.builds(TrapezoidProfile, speed=some.floats(1, 720), acceleration=some.floats(5, 20_000))
ANGLES = some.floats(-180, 180)


@given(start=ANGLES, target=ANGLES, profile=PROFILES)
def test_a_move_arrives_within_its_limits(start: float, target: float, profile: TrapezoidProfile) -> None:
    track, low, high = Track(start), min(start, target), max(start, target)
    longest = 2 * abs(target - start) / profile.speed + 4 * (abs(target - start) / profile.acceleration) ** 0.5
    for _ in range(int((longest + 2 * profile.speed / profile.acceleration) / PERIOD_S) + 50):
        before, speed = track.at, track.speed
        there = track.step(target, profile, PERIOD_S)
        assert abs(track.at - before) <= profile.speed * PERIOD_S + 1e-6
        if not there:
            assert abs(track.speed - speed) <= profile.acceleration * PERIOD_S + 1e-6
        assert low - 1e-6 <= track.at <= high + 1e-6
        if there:
            break
    assert (track.at, track.speed) == (target, 0.0)


@given(targets=some.lists(some.tuples(ANGLES, some.integers(1, 60)), min_size=2, max_size=6), profile=PROFILES)
def test_a_changing_target_stays_within_the_limits(targets: list[tuple[float, int]], profile: TrapezoidProfile) -> None:
    track = Track(0.0)
    for target, steps in targets:
        for _ in range(steps):
            before, speed = track.at, track.speed
            there = track.step(target, profile, PERIOD_S)
            assert abs(track.at - before) <= profile.speed * PERIOD_S + 1e-6
            assert there or abs(track.speed - speed) <= profile.acceleration * PERIOD_S + 1e-6


def test_a_long_move_cruises_at_its_speed() -> None:
    track, profile = Track(0.0), TrapezoidProfile(60.0, 240.0)
    seen = [track.speed for _ in range(100) if not track.step(120.0, profile, PERIOD_S)]
    assert max(seen) == 60.0
    assert sum(speed == 60.0 for speed in seen) > 50
