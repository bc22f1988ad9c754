"""What a program does with one servo."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

from hornbill.client import answers
from hornbill.client.aio.history import AsyncHistory
from hornbill.client.problems import raised
from hornbill.errors import DidNotMove

if TYPE_CHECKING:
    from hornbill.client.aio.hornbill import AsyncHornbill

Value: TypeAlias = bool | int | float | str | None
"""In the unit of the row, a choice's key, or None for "inactive"."""
Progress: TypeAlias = Callable[[answers.Job], None]
SLACK_S = 10.0
"""How much longer than a move we wait for its answer."""


class AsyncServo:
    """One servo. Keys and units of parameters are those of the parameter manual and of GET /schema.

    Every method raises the errors of hornbill.errors: among them NoResponse (nobody knows whether the servo acted),
    Refused (it said no), OutOfRange, Busy, Stopped, LeaseHeld, LeaseRequired.
    """

    def __init__(self, hornbill: "AsyncHornbill", known: answers.Servo) -> None:
        self._hornbill = hornbill
        self._ask = hornbill.ask
        self._path = f"/servos/{known['uid']}"
        self.uid = known["uid"]
        self.known = known
        self.history = AsyncHistory(hornbill, known["uid"])

    @property
    def title(self) -> str:
        """What people call it: its label, else its serial, else the start of its unique id."""
        return self.known["label"] or self.known["serial"] or self.uid[:8]

    async def refresh(self) -> answers.Servo:
        """What the server knows of it now; `known` holds it until the next time."""
        self.known = await self._ask("GET", self._path)
        return self.known

    async def set_label(self, label: str) -> None:
        """Give it a nickname (up to 64 characters), which the server keeps."""
        self.known = await self._ask("PATCH", self._path, {"label": label})

    async def read(self, key: str) -> Value:
        """The value of one parameter, read from the servo now."""
        return (await self.reading(key))["value"]

    async def reading(self, key: str) -> answers.Reading:
        """One parameter, read from the servo now: value, raw, ROM, range, age, whether it has an effect."""
        return await self._ask("GET", f"{self._path}/parameters/{key}")

    async def read_all(self, *, refresh: bool = True) -> answers.Parameters:
        """Every parameter and the revision of the set; `refresh=False`: as last read, without asking the servo."""
        return await self._ask("GET", f"{self._path}/parameters", refresh=refresh)

    async def write(self, key: str, value: bool | int | float | str, *, confirm: Sequence[str] = ()) -> answers.Reading:
        """Write one parameter to RAM and read it back. `confirm`: words of an earlier NeedsConfirmation."""
        return await self._ask("PUT", f"{self._path}/parameters/{key}", {"value": value, "confirm": list(confirm)})

    async def write_many(
        self,
        values: Mapping[str, bool | int | float | str],
        *,
        dry_run: bool = False,
        save: bool = False,
        if_match: str | None = None,
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> answers.ParametersPatched:
        """Write several, all or nothing: when one fails the old values are back and its error is raised.

        `dry_run` writes nothing and answers the plan, with `save` also what ROM will hold.

        `save` writes ROM as well (the servo restarts, and its horn may
        move) and waits until it is read back. `if_match`: a revision of `read_all`; StaleRevision when somebody else
        wrote meanwhile.
        """
        body = {"values": dict(values), "dry_run": dry_run, "save": save, "confirm": list(confirm)}
        headers = {} if if_match is None else {"If-Match": f'"{if_match}"'}
        done: answers.ParametersPatched = await self._ask("PATCH", f"{self._path}/parameters", body, headers=headers)
        problem = done["problem"]
        if problem is not None:
            raise raised(problem["status"], {**problem, "outcome": done["outcome"], "changes": done["changes"]})
        if done["job"] is not None:
            await self._hornbill.wait(done["job"], on_progress=on_progress)
        return done

    async def forecast_restart(self, *, save: bool = False, torque_on: bool = False) -> answers.Forecast:
        """What a restart, or with `save` a save (with `torque_on`), would do to the horn. Reads, moves nothing."""
        return await self._ask("GET", f"{self._path}/restart-forecast", save=save, torque_on=torque_on)

    async def preview_factory_reset(self, *, keep_identity: bool = True) -> answers.ResetPreview:
        """Every row a factory reset would change, what stays, and what its restart does. Changes nothing."""
        return await self._ask("GET", f"{self._path}/factory-reset", keep_identity=keep_identity)

    async def save(
        self, *, confirm: Sequence[str] = (), torque_on: bool = False, on_progress: Progress | None = None
    ) -> answers.Job:
        """Write RAM to ROM, restart, and read it back. With soft start the horn goes slowly to 0°.

        ROM keeps its torque mode unless another was written as configuration; `torque_on` writes on. `confirm`: words
        of an earlier NeedsConfirmation ("torque_off_in_rom", "torque_on_in_rom").
        """
        return await self._job("save", {"confirm": list(confirm), "torque_on": torque_on}, on_progress)

    async def plan_save(self, *, confirm: Sequence[str] = (), torque_on: bool = False) -> answers.SavePreview:
        """What `save` would put into ROM and do to the horn, after every check of it. Saves nothing."""
        body = {"confirm": list(confirm), "torque_on": torque_on, "dry_run": True}
        return await self._ask("POST", f"{self._path}/save", body)

    async def restart(self, *, on_progress: Progress | None = None) -> answers.Job:
        """Restart; what is only in RAM is lost. With soft start the horn goes slowly to 0°."""
        return await self._job("restart", None, on_progress)

    async def factory_reset(self, *, keep_identity: bool = True, on_progress: Progress | None = None) -> answers.Job:
        """The model's defaults, in RAM and ROM. `keep_identity`: servo id, node id and origin stay."""
        return await self._job("factory-reset", {"keep_identity": keep_identity}, on_progress)

    async def identify(self, *, on_progress: Progress | None = None) -> answers.Job:
        """Wiggle the horn a few degrees, so that people see which one it is."""
        return await self._job("identify", None, on_progress)

    async def command(
        self,
        kind: Literal["angle", "speed", "torque"],
        value: float,
        *,
        clamp: bool = False,
        confirm: Sequence[str] = (),
        speed_deg_s: float | None = None,
    ) -> answers.Commanded:
        """Command an angle (°), a speed (rpm) or a torque (%), under a lease and with torque on; kept alive with it.

        Sent once, whatever happens. `clamp` goes to the nearest legal value instead of raising OutOfRange;
        `speed_deg_s` (angles only) goes there at that speed.
        """
        return await self._command(
            {"type": kind, "value": value, "clamp": clamp, "confirm": list(confirm)}, speed_deg_s, SLACK_S
        )

    async def move(
        self,
        angle_deg: float,
        *,
        timeout_s: float = 5.0,
        band_deg: float = 0.5,
        dwell_s: float = 0.2,
        clamp: bool = False,
        confirm: Sequence[str] = (),
        speed_deg_s: float | None = None,
    ) -> answers.Commanded:
        """Command an angle and wait until the horn has stayed within `band_deg` of it for `dwell_s`.

        Raises DidNotMove when it has not after `timeout_s`, with `unmet` (band, dwell or samples), `target_deg`,
        `angle_deg` (as read last) and `in_band_s`.
        """
        body: dict[str, object] = {
            "type": "angle", "value": angle_deg, "wait": "settled", "timeout_s": timeout_s, "band_deg": band_deg,
            "dwell_s": dwell_s, "clamp": clamp, "confirm": list(confirm),
        }  # fmt: skip
        done = await self._command(body, speed_deg_s, 2 * timeout_s + SLACK_S)
        if not done["settled"]:
            raise DidNotMove(
                _unmet(self.title, done, timeout_s=timeout_s, band_deg=band_deg, dwell_s=dwell_s), cause=None,
                unmet=done["unmet"], target_deg=done["value"], angle_deg=done["angle_deg"],
                in_band_s=done["in_band_s"],
            )  # fmt: skip
        return done

    async def torque(self, mode: Literal["on", "off", "brake"]) -> answers.Reading:
        """Energise the motor where it stands (needs a lease), or take its output away (never does)."""
        return await self._ask("POST", f"{self._path}/torque", {"mode": mode}, once=mode == "on")

    async def cautions(self, kind: Literal["angle", "speed", "torque"], value: float) -> list[answers.Caution]:
        """What would be said of a command, without sending it."""
        return await self._ask("GET", f"{self._path}/cautions", type=kind, value=value)

    async def faults(self, *, active: bool = True) -> list[answers.Fault]:
        """Fault bits that are set; with `active=False` past ones, too. Each with what to do about it."""
        found: list[answers.Fault] = await self._ask("GET", f"{self._path}/faults")
        return [one for one in found if one["active"] or not active]

    async def acknowledge_faults(self, key: str | None = None, *, by: str | None = None) -> None:
        """Somebody has seen all of them, or the one; the servo is not told."""
        one = "" if key is None else f"/{key}"
        await self._ask("POST", f"{self._path}/faults{one}/acknowledge", by=by)

    async def position_unit(self) -> answers.PositionUnitState:
        """What position 1.0 on the bus means for this servo, and how that is known."""
        return await self._ask("GET", f"{self._path}/position-unit")

    async def set_position_unit(
        self, unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None
    ) -> answers.PositionUnitState:
        """Say what it means, in place of what was measured; None: measure again."""
        return await self._ask("PUT", f"{self._path}/position-unit", {"unit": unit})

    async def step_test(
        self,
        step_deg: float = 5.0,
        *,
        runs: int = 1,
        dwell_s: float = 1.0,
        note: str = "",
        on_progress: Progress | None = None,
    ) -> answers.Job:
        """Measure a step there and back around where the horn stands, under a lease and with torque on."""
        body = {"step_deg": step_deg, "runs": runs, "dwell_s": dwell_s, "note": note}
        return await self._job("step-test", body, on_progress)

    async def telemetry_state(self) -> answers.Telemetry:
        """What is polled, and for whom."""
        return await self._ask("GET", f"{self._path}/telemetry")

    async def telemetry(
        self, channels: Sequence[str], rate_hz: float, *, ttl_s: float | None = None, owner: str = "client"
    ) -> answers.TelemetryGrant:
        """Have channels polled at so many Hz, for `ttl_s` or until [] is asked for; answers what the bus allows."""
        body = {"channels": list(channels), "rate_hz": rate_hz, "ttl_s": ttl_s, "owner": owner}
        return await self._ask("PUT", f"{self._path}/telemetry", body)

    async def samples_csv(self, seconds: float, channels: Sequence[str] | None = None) -> str:
        """The samples of the last seconds (up to 7200) as CSV, a line a time and a column a channel."""
        keys = None if channels is None else ",".join(channels)
        return await self._ask("GET", f"{self._path}/telemetry.csv", seconds=seconds, channels=keys)

    async def _command(self, body: dict[str, object], speed_deg_s: float | None, timeout_s: float) -> answers.Commanded:
        if speed_deg_s is not None:
            body["profile"] = {"speed_deg_s": speed_deg_s, "accel_deg_s2": 4 * speed_deg_s}
        return await self._ask("POST", f"{self._path}/command", body, once=True, timeout_s=timeout_s)

    async def _job(self, what: str, body: object, on_progress: Progress | None) -> answers.Job:
        job: answers.Job = await self._ask("POST", f"{self._path}/{what}", body)
        return await self._hornbill.wait(job["id"], on_progress=on_progress)


def _unmet(title: str, done: answers.Commanded, *, timeout_s: float, band_deg: float, dwell_s: float) -> str:
    """What was not met of a move, and what to do."""
    target = f"within {band_deg:g}° of {done['value']:g}°"
    if done["unmet"] == "samples":
        return (
            f"{title} did not answer when its angle was read, so it is not known whether it is {target} after "
            f"{timeout_s:g} s. Check its supply and the wiring."
        )
    if done["unmet"] == "dwell":
        return (
            f"{title} is {target}, but after {timeout_s:g} s it has stayed there for {done['in_band_s'] or 0.0:.2f} s "
            f"only, not {dwell_s:g} s. Allow a longer timeout, or a shorter dwell."
        )
    where = "" if done["angle_deg"] is None else f" but at {done['angle_deg']:g}°"
    return (
        f"{title} is not {target}{where} after {timeout_s:g} s. Check whether it is blocked, its limits, and whether "
        "torque is on."
    )
