"""`hornbill apply` and `export` with a running server: differences are shown, and written once."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from e2e.servers import Demo, ready_demo
from hornbill.cli.bench.file import parse


class Bench:
    """A running server, and a file exported from it."""

    def __init__(self, demo: Demo, file: Path) -> None:
        self.demo = demo
        self.file = file
        self.file.write_text(self.hornbill("export").stdout, encoding="utf-8")

    def hornbill(self, *words: str | Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "hornbill", str(words[0]), "--server", self.demo.url, *map(str, words[1:])]
        return subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=120, stdin=subprocess.DEVNULL
        )

    def edit(self, pattern: str, instead: str) -> None:
        """Replace the first match in the file."""
        text = self.file.read_text(encoding="utf-8")
        changed = re.sub(pattern, instead, text, count=1, flags=re.MULTILINE)
        assert changed != text
        self.file.write_text(changed, encoding="utf-8")

    def get(self, path: str) -> Any:
        return self.demo.api.get(path).json()

    def reading(self, key: str, servo: int = 0) -> Any:
        uid = self.get("/servos")[servo]["uid"]
        return self.get(f"/servos/{uid}/parameters/{key}")

    def line(self, start: str) -> int:
        """The number of the first line that starts so, from 1."""
        lines = self.file.read_text(encoding="utf-8").splitlines()
        return next(number for number, line in enumerate(lines, start=1) if line.startswith(start))


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with ready_demo(2, seed=3) as demo:
        yield Bench(demo, tmp_path / "bench.toml")


def test_applying_an_exported_file_changes_nothing(bench: Bench) -> None:
    assert [entry.save for entry in parse(bench.file, bench.file.read_text())] == [True, True]
    checked = bench.hornbill("apply", "--check", bench.file)
    assert (checked.returncode, checked.stdout.splitlines()[-1]) == (0, "No differences.")
    applied = bench.hornbill("apply", bench.file)
    assert applied.returncode == 0, "nothing to confirm"
    assert bench.get("/jobs") == []
    assert [row for row in bench.get("/audit") if row["action"] == "write"] == []


def test_a_changed_file_is_compared_written_and_saved_once(bench: Bench) -> None:
    bench.edit(r"^angle_p_gain = .*", "angle_p_gain = 33")
    bench.edit(r"^smoothing = true", "smoothing = false")
    checked = bench.hornbill("apply", "--check", bench.file)
    assert checked.returncode == 1
    assert "+ angle_p_gain = 33" in checked.stdout
    assert "+ smoothing = false" in checked.stdout
    assert "1 of 2 servos differ." in checked.stdout
    assert bench.reading("angle_p_gain")["value"] != 33, "a check writes nothing"

    unconfirmed = bench.hornbill("apply", bench.file)
    assert unconfirmed.returncode == 2
    assert bench.reading("angle_p_gain")["value"] != 33, "it was not confirmed"

    applied = bench.hornbill("apply", "--yes", bench.file)
    assert applied.returncode == 0, applied.stdout + applied.stderr
    assert bench.reading("angle_p_gain")["rom"] == 33
    assert bench.reading("smoothing")["rom"] is False
    jobs, uptime = bench.get("/jobs"), bench.get("/servos")[0]["uptime_s"]
    assert [job["kind"] for job in jobs] == ["save"]

    again = bench.hornbill("apply", "--yes", bench.file)
    assert (again.returncode, again.stdout.splitlines()[-1]) == (0, "No differences.")
    assert bench.get("/jobs") == jobs
    assert bench.get("/servos")[0]["uptime_s"] >= uptime, "it was not restarted"
    exported = bench.hornbill("export").stdout
    before, after = (parse(bench.file, text) for text in (bench.file.read_text(), exported))
    assert [(one.name, one.save, one.values) for one in before] == [(one.name, one.save, one.values) for one in after]


def test_values_in_ram_only_are_saved(bench: Bench) -> None:
    serial = bench.get("/servos")[0]["serial"]
    assert bench.hornbill("set", serial, "angle_boost=1").returncode == 0
    bench.edit(r"^angle_boost = .*", "angle_boost = 1")
    checked = bench.hornbill("apply", "--check", bench.file)
    assert checked.returncode == 1
    assert "~ angle_boost = 1.0 in RAM, 0.0 in ROM" in checked.stdout
    assert bench.hornbill("apply", "--yes", bench.file).returncode == 0
    assert bench.reading("angle_boost")["rom"] == 1


def test_drift_is_a_difference(bench: Bench) -> None:
    serial = bench.get("/servos")[1]["serial"]
    assert bench.hornbill("set", serial, "angle_d_gain=7", "--save").returncode == 0
    checked = bench.hornbill("apply", "--check", bench.file)
    assert checked.returncode == 1
    assert "- angle_d_gain = 7" in checked.stdout


def test_errors_are_reported_with_their_lines_and_nothing_is_written(bench: Bench) -> None:
    bench.edit(r"^smoothing = true", "smoothing = false")
    bench.edit(r"^angle_p_gain = .*", "angle_p_gain = 0")
    failed = bench.hornbill("apply", "--yes", bench.file)
    assert failed.returncode == 1
    assert f"bench.toml:{bench.line('angle_p_gain = 0')}: " in failed.stderr
    assert "below this model's limit of 1" in failed.stderr
    bench.edit(r"^angle_p_gain = 0", "angle_p_gian = 40")
    bench.edit(r"^uid = .*", 'serial = "99-999999"')
    failed = bench.hornbill("apply", "--yes", bench.file)
    assert failed.returncode == 1
    assert f"bench.toml:{bench.line('angle_p_gian')}: Unknown key 'angle_p_gian'. Did you mean" in failed.stderr
    assert f"bench.toml:{bench.line('serial')}: No servo has serial '99-999999'" in failed.stderr
    assert bench.reading("smoothing")["value"] is True
    assert bench.get("/jobs") == []


def test_a_file_is_applied_after_motion_without_saving_torque_off(bench: Bench) -> None:
    serial = bench.get("/servos")[0]["serial"]
    for gain in (33, 34):  # apply; run; apply
        bench.edit(r"^angle_p_gain = .*", f"angle_p_gain = {gain}")
        applied = bench.hornbill("apply", "--yes", bench.file)
        assert applied.returncode == 0, applied.stdout + applied.stderr
        assert f"ROM: angle_p_gain {'40' if gain == 33 else '33'} → {gain}" in applied.stdout
        assert "ROM: torque_mode" not in applied.stdout
        assert (bench.reading("angle_p_gain")["rom"], bench.reading("torque_mode")["rom"]) == (gain, "on")
        moved = bench.hornbill("move", serial, "2", "--torque-on")
        assert moved.returncode == 0, moved.stderr
        assert bench.reading("torque_mode")["value"] == "off", "motion control ends with torque off"


def test_saving_torque_off_requires_a_confirmation_in_the_file(bench: Bench) -> None:
    bench.edit(r"^angle_p_gain = .*", 'angle_p_gain = 33\ntorque_mode = "off"')
    refused = bench.hornbill("apply", "--yes", bench.file)
    assert refused.returncode == 1
    assert 'confirm = ["torque_off_in_rom"]' in refused.stderr
    assert bench.reading("angle_p_gain")["value"] != 33
    bench.edit(r"^save = true.*", 'save = true\nconfirm = ["torque_off_in_rom"]')
    applied = bench.hornbill("apply", "--yes", bench.file)
    assert applied.returncode == 0, applied.stderr
    assert "ROM: torque_mode on → off" in applied.stdout
    assert bench.reading("torque_mode")["rom"] == "off"


def test_values_of_the_file_override_those_of_its_profile(bench: Bench) -> None:
    servo = bench.get("/servos")[0]
    values = {"angle_p_gain": 21, "angle_d_gain": 22}
    bench.demo.api.put("/profiles/soft", json={"values": values}).raise_for_status()
    text = f'[[servo]]\nserial = "{servo["serial"]}"\nprofile = "soft"\n[servo.values]\nangle_d_gain = 23\n'
    bench.file.write_text(text)
    assert bench.hornbill("apply", "--yes", bench.file).returncode == 0
    assert (bench.reading("angle_p_gain")["value"], bench.reading("angle_d_gain")["value"]) == (21, 23)
    assert bench.reading("angle_p_gain")["rom"] != 21, "the file does not say save"
    bench.edit('"soft"', '"hard"')
    failed = bench.hornbill("apply", "--check", bench.file)
    assert "bench.toml:3: Unknown profile 'hard'. Known profiles: soft." in failed.stderr
