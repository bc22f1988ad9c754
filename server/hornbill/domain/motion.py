"""Motion control: leases, takeover, stop, restoring outputs, and cautions before a command."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.fields import STRICT, Model, MotionCode, UidField, UidText, Utc
from hornbill.domain.problem import Problem
from hornbill.domain.servo import Output

StopMode = TypeAliasType("StopMode", Literal["off", "brake"])

CautionCode = TypeAliasType(
    "CautionCode",
    Literal["turns", "turn_count", "continuous_rotation", "below_minimum", "timeout_hold", "pwm", "timeout_too_short"],
)


@dataclass(frozen=True, slots=True, config=STRICT)
class Caution:
    """A caution about a command."""

    level: Literal["warning", "failure"] = Field(description="failure: the motion may never end.")
    code: CautionCode = Field(description="Code for programs. Stable.")
    text: str = Field(description="One sentence for users.")
    confirm: MotionCode | None = Field(description="Confirmation code required to send it. Null if none.")
    params: dict[str, float] = Field(description="Values in the text, by name with unit.")


class MotionProfile(Model):
    """Trapezoidal speed profile of a move, sent as 50 angles per second."""

    speed_deg_s: float = Field(default=60.0, gt=0, le=3600, description="Speed limit, °/s.")
    accel_deg_s2: float = Field(default=240.0, gt=0, le=100_000, description="Acceleration and deceleration, °/s².")


class MotionHold(Model):
    """Time limit of a speed or torque command, renewed while a button is held."""

    for_s: float = Field(
        default=0.5, ge=0.1, le=5, description="Time after which the servo is braked unless renewed, s."
    )
    renew: bool = Field(default=False, description="Only renew a running command. Refused as busy if it was braked.")


class PendingRequest(Model):
    """Pending request for motion control. It is granted after `expires_in_s` unless refused."""

    id: str = Field(description="ID with which to refuse the request.")
    by: str = Field(description="Client that requests motion control.")
    reason: str = Field(description="Reason for the request.")
    expires_in_s: float = Field(description="Time until motion control passes unless refused, s.")


class Lease(Model):
    """Lease, which grants motion control. When it expires, torque goes off on the servos it commanded."""

    id: str = Field(description="ID, as used in paths.")
    heartbeat_s: float = Field(
        description="Interval at which to renew it, s of real time: a third of `ttl_s`, shorter in virtual time."
    )
    shown_id: str = Field(description="First digits of `id`, visible to all clients.")
    holder: str = Field(description="Client with motion control.")
    uids: list[UidText] | None = Field(default=None, description="Servos it covers, unique IDs. Null: all.")
    ttl_s: float = Field(description="Time to live after each renewal, s.")
    expires_at: float = Field(description="Expiry, seconds since 1970 UTC.")
    expires_in_s: float = Field(description="Time until it expires unless renewed, s.")
    request: PendingRequest | None = Field(description="Pending request for motion control. Null if none.")


class LeaseView(Model):
    """Lease as visible to other clients, without its secret ID."""

    shown_id: str = Field(description="First digits of its ID, which distinguish leases but do not allow their use.")
    holder: str = Field(description="Client with motion control.")
    uids: list[UidText] | None = Field(default=None, description="Servos it covers, unique IDs. Null: all.")
    ttl_s: float = Field(description="Time to live after each renewal, s.")
    expires_at: Utc
    expires_in_s: float = Field(description="Time until it expires unless renewed, s.")
    request: PendingRequest | None = Field(description="Pending request for motion control. Null if none.")


class RestorableOutput(Model):
    """A servo whose output would be restored."""

    uid: UidText
    title: str = Field(description="Display name.")
    output: Output
    torque_pct: int | None = Field(description="Current torque as just read, %. Null if unknown.")
    under_load: bool = Field(description="Braked, turning or above 20 % torque. Requires confirmation.")
    needs_lease: bool = Field(
        description="The servo's timeout (0x26) would switch it off again. It stays on until the lease ends."
    )
    problem: Problem | None = Field(description="Reason why it would stay off. Null if none.")


class OutputRestorePreview(Model):
    """Effect of restoring outputs."""

    clears_stop: bool = Field(description="Would first clear a latched stop.")
    servos: list[RestorableOutput] = Field(description="One entry per servo.")


class StopServo(Model):
    """Confirmation of a stop by one servo."""

    uid: UidField
    label: str = Field(description="Nickname. Empty if none.")
    confirmed: bool = Field(description="The response to torque off (or brake) was received.")
    ms: float | None = Field(description="Time from the request to the response, ms. Null until then.")


class StopNode(Model):
    """Confirmation of a stop by a node that may be a servo but is not identified."""

    node_id: int = Field(description="Node ID, 1 to 127.")
    confirmed: bool = Field(description="The response to torque off (or brake) was received.")
    ms: float | None = Field(description="Time from the request to the response, ms. Null until then.")


class Stop(Model):
    """The stop latch."""

    latched: bool = Field(description="Motion is blocked until the stop is cleared.")
    mode: StopMode | None = Field(description="Torque off or brake. Null while not latched.")
    at: float | None = Field(description="Time of the stop, seconds since 1970 UTC. Null while not latched.")
    by: str | None = Field(description="Client that stopped. Null while not latched.")
    reason: str | None = Field(
        description="Reason: text, or the page's code `stop_button`, `esc_key` or `space_key`. Null while not latched."
    )
    servos: list[StopServo] = Field(description="One entry per servo.")
    nodes: list[StopNode] = Field(
        default_factory=list[StopNode], description="Nodes that broadcast actuator status and may be servos."
    )
    reach: Literal["all", "own", "none"] = Field(
        description="all: every servo (role host, or a guest's stop with `everyone`). own: servos that hornbill "
        "commands (role guest). none: nothing is sent (role observer)."
    )
    reaches: list[UidField] = Field(description="Unique IDs of the online servos that a stop reaches now.")


class TakeOverState(Model):
    """State of a request for motion control."""

    id: str = Field(description="ID, as used in paths.")
    by: str = Field(description="Client that requests motion control.")
    reason: str = Field(description="Reason for the request.")
    state: Literal["waiting", "granted", "refused", "withdrawn"] = Field(description="State of the request.")
    expires_in_s: float = Field(description="Time until it is granted unless refused, s.")
    lease_id: str | None = Field(
        default=None, description="ID of the lease. Returned once, to the client that requested it, when granted."
    )
    holder: LeaseView | None = Field(default=None, description="Current lease of another client. Null if none.")
