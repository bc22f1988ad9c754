"""Client of one servo."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

from hornbill.client.problems import raised
from hornbill.client.sync.history import History
from hornbill.errors import DidNotMove

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.hornbill import Hornbill

Value: TypeAlias = bool | int | float | str | None
"""Value in the unit of the row, key of a choice, or None for inactive."""
Progress: TypeAlias = "Callable[[responses.Job], None]"
SLACK_S = 10.0
"""Time added to the duration of a move, for the response timeout."""


class Servo:
    """One servo. Keys and units of parameters are those of the parameter manual and of GET /schema.

    Methods raise the errors of hornbill.errors, among them NoResponse (whether the servo acted is unknown), Refused,
    OutOfRange, Busy, Stopped, LeaseHeld and LeaseRequired.
    """

    def __init__(self, hornbill: Hornbill, known: responses.Servo) -> None:
        self._hornbill = hornbill
        self._request = hornbill.request
        self._path = f"/servos/{known['uid']}"
        self.uid = known["uid"]
        self.known = known
        self.history = History(hornbill, known["uid"])

    @property
    def title(self) -> str:
        """Display name: label, else serial, else the start of the unique ID."""
        return self.known["label"] or self.known["serial"] or self.uid[:8]

    def refresh(self) -> responses.Servo:
        """Get the current state from the server, and store it in `known`."""
        self.known = self._request("GET", self._path)
        return self.known

    def set_label(self, label: str) -> None:
        """Set the nickname (up to 64 characters), which is stored on the server."""
        self.known = self._request("PATCH", self._path, {"label": label})

    def read(self, key: str) -> Value:
        """Read the value of one parameter from the servo."""
        return (self.reading(key))["value"]

    def reading(self, key: str) -> responses.Reading:
        """Read one parameter from the servo, with raw value, ROM value, range, age and effect."""
        return self._request("GET", f"{self._path}/parameters/{key}")

    def read_all(self, *, refresh: bool = True) -> responses.Parameters:
        """All parameters and their revision; `refresh=False`: as last read, without reading from the servo."""
        return self._request("GET", f"{self._path}/parameters", refresh=refresh)

    def write(self, key: str, value: bool | int | float | str, *, confirm: Sequence[str] = ()) -> responses.Reading:
        """Write one parameter to RAM and read it back. `confirm`: codes of an earlier NeedsConfirmation."""
        return self._request("PUT", f"{self._path}/parameters/{key}", {"value": value, "confirm": list(confirm)})

    def write_many(
        self,
        values: Mapping[str, bool | int | float | str],
        *,
        dry_run: bool = False,
        save: bool = False,
        if_match: str | None = None,
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> responses.ParametersPatched:
        """Write parameters, all or nothing. On failure the old values are restored and the error is raised.

        `dry_run` writes nothing and returns the plan, with `save` including the ROM changes. `save` also writes ROM
        (the servo restarts and its horn may move) and waits until it is read back. `if_match`: a revision of
        `read_all`; raises StaleRevision if another client has written since.
        """
        body = {"values": dict(values), "dry_run": dry_run, "save": save, "confirm": list(confirm)}
        headers = {} if if_match is None else {"If-Match": f'"{if_match}"'}
        done: responses.ParametersPatched = self._request("PATCH", f"{self._path}/parameters", body, headers=headers)
        problem = done["problem"]
        if problem is not None:
            raise raised(problem["status"], {**problem, "outcome": done["outcome"], "changes": done["changes"]})
        if done["job"] is not None:
            self._hornbill.wait(done["job"], on_progress=on_progress)
        return done

    def forecast_restart(self, *, save: bool = False, torque_on: bool = False) -> responses.Forecast:
        """Effect of a restart, or with `save` of a save (with `torque_on`), on the horn. Moves nothing."""
        return self._request("GET", f"{self._path}/restart-forecast", save=save, torque_on=torque_on)

    def preview_factory_reset(self, *, keep_identity: bool = True) -> responses.ResetPreview:
        """Rows that a factory reset would change or keep, and its effect on the horn. Changes nothing."""
        return self._request("GET", f"{self._path}/factory-reset", keep_identity=keep_identity)

    def save(
        self, *, confirm: Sequence[str] = (), torque_on: bool = False, on_progress: Progress | None = None
    ) -> responses.Job:
        """Write RAM to ROM, restart, and read it back. With soft start the horn moves slowly to 0°.

        ROM keeps its torque mode unless another was written as configuration; `torque_on` writes on. `confirm`: codes
        of an earlier NeedsConfirmation ("torque_off_in_rom", "torque_on_in_rom").
        """
        return self._job("save", {"confirm": list(confirm), "torque_on": torque_on}, on_progress)

    def plan_save(self, *, confirm: Sequence[str] = (), torque_on: bool = False) -> responses.SavePreview:
        """ROM changes of `save` and its effect on the horn, after all its checks. Saves nothing."""
        body = {"confirm": list(confirm), "torque_on": torque_on, "dry_run": True}
        return self._request("POST", f"{self._path}/save", body)

    def restart(self, *, on_progress: Progress | None = None) -> responses.Job:
        """Restart. Values that are only in RAM are lost. With soft start the horn moves slowly to 0°."""
        return self._job("restart", None, on_progress)

    def factory_reset(self, *, keep_identity: bool = True, on_progress: Progress | None = None) -> responses.Job:
        """Reset to the defaults of the model, in RAM and ROM. `keep_identity`: keep servo ID, node ID and origin."""
        return self._job("factory-reset", {"keep_identity": keep_identity}, on_progress)

    def identify(self, *, on_progress: Progress | None = None) -> responses.Job:
        """Wiggle the horn to identify the servo."""
        return self._job("identify", None, on_progress)

    def command(
        self,
        kind: Literal["angle", "speed", "torque"],
        value: float,
        *,
        clamp: bool = False,
        confirm: Sequence[str] = (),
        speed_deg_s: float | None = None,
    ) -> responses.Commanded:
        """Command an angle (°), speed (rpm) or torque (%). Requires a lease and torque on; kept alive until it ends.

        Sent once, never retried. `clamp` sends the nearest valid value instead of raising OutOfRange. `speed_deg_s`
        (angles only) limits the speed.
        """
        return self._command(
            {"type": kind, "value": value, "clamp": clamp, "confirm": list(confirm)}, speed_deg_s, SLACK_S
        )

    def move(
        self,
        angle_deg: float,
        *,
        timeout_s: float = 5.0,
        band_deg: float = 0.5,
        dwell_s: float = 0.2,
        clamp: bool = False,
        confirm: Sequence[str] = (),
        speed_deg_s: float | None = None,
    ) -> responses.Commanded:
        """Command an angle and wait until the horn has stayed within `band_deg` of it for `dwell_s`.

        Raises DidNotMove after `timeout_s`, with `unmet` (band, dwell or samples), `target_deg`, `angle_deg` (last
        read) and `in_band_s`.
        """
        body: dict[str, object] = {
            "type": "angle", "value": angle_deg, "wait": "settled", "timeout_s": timeout_s, "band_deg": band_deg,
            "dwell_s": dwell_s, "clamp": clamp, "confirm": list(confirm),
        }  # fmt: skip
        done = self._command(body, speed_deg_s, 2 * timeout_s + SLACK_S)
        if not done["settled"]:
            raise DidNotMove(
                _unmet(self.title, done, timeout_s=timeout_s, band_deg=band_deg, dwell_s=dwell_s), cause=None,
                unmet=done["unmet"], target_deg=done["value"], angle_deg=done["angle_deg"],
                in_band_s=done["in_band_s"],
            )  # fmt: skip
        return done

    def torque(self, mode: Literal["on", "off", "brake"]) -> responses.Reading:
        """Set the torque mode. On requires a lease and holds the current angle; off and brake need no lease."""
        return self._request("POST", f"{self._path}/torque", {"mode": mode}, once=mode == "on")

    def cautions(self, kind: Literal["angle", "speed", "torque"], value: float) -> list[responses.Caution]:
        """Cautions about a command. Sends nothing."""
        return self._request("GET", f"{self._path}/cautions", type=kind, value=value)

    def faults(self, *, active: bool = True) -> list[responses.Fault]:
        """Active fault bits, each with advice; with `active=False` also past ones."""
        found: list[responses.Fault] = self._request("GET", f"{self._path}/faults")
        return [one for one in found if one["active"] or not active]

    def acknowledge_faults(self, key: str | None = None, *, by: str | None = None) -> None:
        """Acknowledge all faults, or one. Sends nothing to the servo."""
        one = "" if key is None else f"/{key}"
        self._request("POST", f"{self._path}/faults{one}/acknowledge", by=by)

    def position_unit(self) -> responses.PositionUnitState:
        """Unit of positions on the bus, and its evidence."""
        return self._request("GET", f"{self._path}/position-unit")

    def set_position_unit(
        self, unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None
    ) -> responses.PositionUnitState:
        """Set the position unit. None: measure it again."""
        return self._request("PUT", f"{self._path}/position-unit", {"unit": unit})

    def step_test(
        self,
        step_deg: float = 5.0,
        *,
        runs: int = 1,
        dwell_s: float = 1.0,
        note: str = "",
        set_up: Mapping[str, float | str | None] | None = None,
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Measure a step from the current angle and back. Requires a lease and torque on.

        `set_up`: that of this run, None for that of the servo.
        """
        body = {"step_deg": step_deg, "runs": runs, "dwell_s": dwell_s, "note": note, "set_up": set_up}
        return self._job("step-test", body, on_progress)

    def set_up(self) -> responses.SetUp:
        """Set-up: load, mounting and surroundings, which runs copy."""
        return self._request("GET", f"{self._path}/set-up")

    def put_set_up(self, set_up: Mapping[str, float | str | None]) -> responses.SetUp:
        """Replace the set-up. Values that are not given become null (not stated)."""
        return self._request("PUT", f"{self._path}/set-up", dict(set_up))

    def improve(
        self,
        goal: Literal["calm", "fast", "stiff"] = "calm",
        *,
        bounds: Mapping[str, float] | None = None,
        expert: bool = False,
        note: str = "",
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Find better gains by measured steps. Requires a lease and torque on. `bounds`: from_deg, to_deg, torque_pct,
        speed_rpm, time_s."""
        body = {"goal": goal, "bounds": dict(bounds or {}), "expert": expert, "note": note}
        return self._job("improve", body, on_progress)

    def plan_improve(
        self,
        goal: Literal["calm", "fast", "stiff"] = "calm",
        *,
        bounds: Mapping[str, float] | None = None,
        expert: bool = False,
    ) -> responses.ImprovePreview:
        """What `improve` would move and write, how far and for how long. Moves nothing."""
        body = {"goal": goal, "bounds": dict(bounds or {}), "expert": expert}
        return self._request("POST", f"{self._path}/improve/plan", body)

    def measure_mechanics(
        self,
        tests: Sequence[str] = ("friction",),
        *,
        from_deg: float | None = None,
        to_deg: float | None = None,
        torque_pct: float = 60.0,
        speed_rpm: float = 60.0,
        note: str = "",
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Measure mechanics within a range (°): deadband, repeatability, speed, friction (with backlash), travel,
        end_stops. Requires a lease and torque on. Gains and limits are changed in RAM meanwhile, and restored."""
        body = {
            "tests": list(tests), "from_deg": from_deg, "to_deg": to_deg, "torque_pct": torque_pct,
            "speed_rpm": speed_rpm, "note": note,
        }  # fmt: skip
        return self._job("mechanics", body, on_progress)

    def mechanics(self) -> responses.Mechanics:
        """Newest measured mechanics, with 95 % intervals."""
        return self._request("GET", f"{self._path}/mechanics")

    def export_mechanics(
        self, format: Literal["json", "mujoco", "urdf"] = "json", *, stall_nm: float | None = None
    ) -> bytes:
        """Twin for the simulator (json), or actuator for MuJoCo or URDF. `stall_nm`: stall torque, N·m; without it
        torque is in shares of it."""
        return self._hornbill.download(f"{self._path}/mechanics/export", format=format, stall_nm=stall_nm)

    def frequency_response(
        self,
        *,
        excitation: str = "chirp",
        amplitude_deg: float = 2.0,
        from_hz: float = 0.5,
        to_hz: float = 20.0,
        duration_s: float = 20.0,
        ladder: bool = False,
        note: str = "",
        set_up: Mapping[str, float | str | None] | None = None,
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Measure the frequency response about the current angle. Requires a lease and torque on.

        `set_up`: that of this run, None for that of the servo.
        """
        body = {
            "excitation": excitation, "amplitude_deg": amplitude_deg, "from_hz": from_hz, "to_hz": to_hz,
            "duration_s": duration_s, "ladder": ladder, "note": note,
            "set_up": set_up,
        }  # fmt: skip
        return self._job("frequency-response", body, on_progress)

    def telemetry_state(self) -> responses.Telemetry:
        """Telemetry subscriptions, and rates of channels."""
        return self._request("GET", f"{self._path}/telemetry")

    def telemetry(
        self, channels: Sequence[str], rate_hz: float, *, ttl_s: float | None = None, owner: str = "client"
    ) -> responses.TelemetryGrant:
        """Subscribe to channels at `rate_hz`, for `ttl_s` or until replaced ([] ends it). Returns the granted rate."""
        body = {"channels": list(channels), "rate_hz": rate_hz, "ttl_s": ttl_s, "owner": owner}
        return self._request("PUT", f"{self._path}/telemetry", body)

    def samples_csv(self, seconds: float, channels: Sequence[str] | None = None) -> str:
        """Samples of the last `seconds` (up to 7200) as CSV: one line per time, one column per channel."""
        keys = None if channels is None else ",".join(channels)
        return self._request("GET", f"{self._path}/telemetry.csv", seconds=seconds, channels=keys)

    def _command(self, body: dict[str, object], speed_deg_s: float | None, timeout_s: float) -> responses.Commanded:
        if speed_deg_s is not None:
            body["profile"] = {"speed_deg_s": speed_deg_s, "accel_deg_s2": 4 * speed_deg_s}
        return self._request("POST", f"{self._path}/command", body, once=True, timeout_s=timeout_s)

    def _job(self, what: str, body: object, on_progress: Progress | None) -> responses.Job:
        job: responses.Job = self._request("POST", f"{self._path}/{what}", body)
        return self._hornbill.wait(job["id"], on_progress=on_progress)


def _unmet(title: str, done: responses.Commanded, *, timeout_s: float, band_deg: float, dwell_s: float) -> str:
    """Error text for a move that has not settled."""
    target = f"within {band_deg:g}° of {done['value']:g}°"
    if done["unmet"] == "samples":
        return (
            f"{title} did not respond to angle reads, so it is unknown whether it is {target} after {timeout_s:g} s. "
            "Check its supply and wiring."
        )
    if done["unmet"] == "dwell":
        return (
            f"{title} is {target}, but after {timeout_s:g} s it has stayed there for only "
            f"{done['in_band_s'] or 0.0:.2f} s of {dwell_s:g} s. Use a longer timeout or a shorter dwell."
        )
    where = "" if done["angle_deg"] is None else f" but at {done['angle_deg']:g}°"
    return (
        f"{title} is not {target}{where} after {timeout_s:g} s. Check whether it is blocked, its limits, and whether "
        "torque is on."
    )
