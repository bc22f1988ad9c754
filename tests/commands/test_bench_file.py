"""`hornbill apply` and `export` with a running server: differences are shown, and written once."""

import re
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from commands.command_line import hornbill
from commands.conftest import COUNT
from e2e.servers import Server
from hornbill.cli.bench.file import parse


class Bench:
    """A running server, a file exported from it, and the servo that the file names first."""

    def __init__(self, server: Server, path: Path, serial: str) -> None:
        self.server = server
        self.path = path
        self.serial = serial
        lines = hornbill(server.url, "export").stdout.split("[[servo]]")
        own = next(number for number, one in enumerate(lines) if serial in one)
        lines.insert(1, lines.pop(own))
        self.path.write_text("[[servo]]".join(lines), encoding="utf-8")

    def hornbill(self, *words: object) -> Result:
        return hornbill(self.server.url, *words)

    def edit(self, pattern: str, instead: str) -> None:
        """Replace the first match in the file."""
        text = self.path.read_text(encoding="utf-8")
        changed = re.sub(pattern, instead, text, count=1, flags=re.MULTILINE)
        assert changed != text
        self.path.write_text(changed, encoding="utf-8")

    def get(self, path: str) -> Any:
        return self.server.api.get(path).json()

    def servo(self) -> Any:
        return next(one for one in self.get("/servos") if one["serial"] == self.serial)

    def reading(self, key: str) -> Any:
        return self.get(f"/servos/{self.servo()['uid']}/parameters/{key}")

    def writes(self) -> list[Any]:
        """What changes servos: jobs, and entries of the audit."""
        return [self.get("/jobs"), [row for row in self.get("/audit") if row["action"] == "write"]]

    def line(self, start: str) -> int:
        """The number of the first line that starts so, from 1."""
        lines = self.path.read_text(encoding="utf-8").splitlines()
        return next(number for number, line in enumerate(lines, start=1) if line.startswith(start))


@pytest.fixture
def file(bench: Server, serial: str, tmp_path: Path) -> Bench:
    return Bench(bench, tmp_path / "bench.toml", serial)


def test_applying_an_exported_file_changes_nothing(file: Bench) -> None:
    assert all(entry.save for entry in parse(file.path, file.path.read_text()))
    before = file.writes()
    for words in (("apply", "--check"), ("apply",)):  # nothing to confirm
        done = file.hornbill(*words, file.path)
        assert (done.exit_code, done.stdout.splitlines()[-1]) == (0, "No differences.")
    assert file.writes() == before


def test_a_changed_file_is_compared_written_and_saved_once(file: Bench) -> None:
    gain, smoothing = (file.reading(key)["value"] for key in ("angle_p_gain", "smoothing"))
    changed = f"angle_p_gain = {gain + 1}", f"smoothing = {str(not smoothing).lower()}"
    file.edit(r"^angle_p_gain = .*", changed[0])
    file.edit(r"^smoothing = .*", changed[1])
    before = file.writes()
    checked = file.hornbill("apply", "--check", file.path)
    assert checked.exit_code == 1
    for shown in (*(f"+ {each}" for each in changed), f"1 of {COUNT} servos differ."):
        assert shown in checked.stdout
    assert file.hornbill("apply", file.path).exit_code == 2, "it is not confirmed"
    assert file.writes() == before

    applied = file.hornbill("apply", "--yes", file.path)
    assert applied.exit_code == 0, applied.output
    assert [file.reading(key)["rom"] for key in ("angle_p_gain", "smoothing")] == [gain + 1, not smoothing]
    (job,) = (one for one in file.get("/jobs") if one not in before[0])
    assert job["kind"] == "save"

    after, uptime_s = file.writes(), file.servo()["uptime_s"]
    again = file.hornbill("apply", "--yes", file.path)
    assert (again.exit_code, again.stdout.splitlines()[-1]) == (0, "No differences.")
    assert file.writes() == after
    assert file.servo()["uptime_s"] >= uptime_s, "it was not restarted"
    written, exported = (
        {one.name: (one.save, one.values) for one in parse(file.path, text)}
        for text in (file.path.read_text(), file.hornbill("export").stdout)
    )
    assert written == exported


def test_values_in_ram_only_are_saved(file: Bench) -> None:
    rom = file.reading("angle_boost")["rom"]
    assert file.hornbill("set", file.serial, f"angle_boost={rom + 1}").exit_code == 0
    file.edit(r"^angle_boost = .*", f"angle_boost = {rom + 1}")
    checked = file.hornbill("apply", "--check", file.path)
    assert checked.exit_code == 1
    assert f"~ angle_boost = {rom + 1:.1f} in RAM, {rom:.1f} in ROM" in checked.stdout
    assert file.hornbill("apply", "--yes", file.path).exit_code == 0
    assert file.reading("angle_boost")["rom"] == rom + 1


def test_drift_is_a_difference(file: Bench) -> None:
    gain = file.reading("angle_d_gain")["rom"]
    assert file.hornbill("set", file.serial, f"angle_d_gain={gain + 1}", "--save").exit_code == 0
    checked = file.hornbill("apply", "--check", file.path)
    assert checked.exit_code == 1
    assert f"- angle_d_gain = {gain + 1}" in checked.stdout


def test_errors_are_reported_with_their_lines_and_nothing_is_written(file: Bench) -> None:
    before = file.writes()
    file.edit(r"^smoothing = .*", f"smoothing = {str(not file.reading('smoothing')['value']).lower()}")
    file.edit(r"^angle_p_gain = .*", "angle_p_gain = 0")
    failed = file.hornbill("apply", "--yes", file.path)
    assert failed.exit_code == 1
    assert f"bench.toml:{file.line('angle_p_gain = 0')}: " in failed.stderr
    assert "below this model's limit of 1" in failed.stderr
    file.edit(r"^angle_p_gain = 0", "angle_p_gian = 40")
    file.edit(r"^uid = .*", 'serial = "99-999999"')
    failed = file.hornbill("apply", "--yes", file.path)
    assert failed.exit_code == 1
    assert f"bench.toml:{file.line('angle_p_gian')}: Unknown key 'angle_p_gian'. Did you mean" in failed.stderr
    assert f"bench.toml:{file.line('serial')}: No servo has serial '99-999999'" in failed.stderr
    assert file.writes() == before


def test_a_file_is_applied_after_motion_without_saving_torque_off(file: Bench) -> None:
    for _ in range(2):  # apply; run; apply
        gain = file.reading("angle_p_gain")["rom"]
        file.edit(r"^angle_p_gain = .*", f"angle_p_gain = {gain + 1}")
        applied = file.hornbill("apply", "--yes", file.path)
        assert applied.exit_code == 0, applied.output
        assert f"ROM: angle_p_gain {gain} → {gain + 1}" in applied.stdout
        assert "ROM: torque_mode" not in applied.stdout
        assert (file.reading("angle_p_gain")["rom"], file.reading("torque_mode")["rom"]) == (gain + 1, "on")
        moved = file.hornbill("move", file.serial, "2", "--torque-on", "--timeout", "60")
        assert moved.exit_code == 0, moved.stderr
        assert file.reading("torque_mode")["value"] == "off", "motion control ends with torque off"


def test_saving_torque_off_requires_a_confirmation_in_the_file(file: Bench) -> None:
    gain = file.reading("angle_p_gain")["value"]
    file.edit(r"^angle_p_gain = .*", f'angle_p_gain = {gain + 1}\ntorque_mode = "off"')
    refused = file.hornbill("apply", "--yes", file.path)
    assert refused.exit_code == 1
    assert 'confirm = ["torque_off_in_rom"]' in refused.stderr
    assert file.reading("angle_p_gain")["value"] == gain
    file.edit(r"^save = true.*", 'save = true\nconfirm = ["torque_off_in_rom"]')
    applied = file.hornbill("apply", "--yes", file.path)
    assert applied.exit_code == 0, applied.stderr
    assert "ROM: torque_mode on → off" in applied.stdout
    assert file.reading("torque_mode")["rom"] == "off"
    save = f"/servos/{file.servo()['uid']}/save?wait=true"
    file.server.api.post(save, json={"torque_on": True}).raise_for_status()


def test_values_of_the_file_override_those_of_its_profile(file: Bench) -> None:
    values = {"angle_p_gain": 21, "angle_d_gain": 22}
    file.server.api.put("/profiles/soft", json={"values": values}).raise_for_status()
    text = f'[[servo]]\nserial = "{file.serial}"\nprofile = "soft"\n[servo.values]\nangle_d_gain = 23\n'
    file.path.write_text(text)
    assert file.hornbill("apply", "--yes", file.path).exit_code == 0
    assert (file.reading("angle_p_gain")["value"], file.reading("angle_d_gain")["value"]) == (21, 23)
    assert file.reading("angle_p_gain")["rom"] != 21, "the file does not say save"
    file.edit('"soft"', '"hard"')
    failed = file.hornbill("apply", "--check", file.path)
    assert "bench.toml:3: Unknown profile 'hard'. Known profiles: " in failed.stderr
    file.server.api.delete("/profiles/soft").raise_for_status()
