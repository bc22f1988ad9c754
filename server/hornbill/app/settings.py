"""Settings from command line options and HORNBILL_… environment variables, read at start."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, cast

from platformdirs import user_data_path
from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from hornbill.domain.bus import ConnectionRoleChoice
from hornbill.virtual_time import MAX_SPEED


class Settings(BaseSettings):
    """Settings of the server. Frozen. Options of the command line override the environment."""

    model_config = SettingsConfigDict(env_prefix="HORNBILL_", frozen=True, extra="ignore")

    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on; 0 for any free one.")
    token: SecretStr | None = Field(
        default=None, description="Additional admin token, at least 16 characters, which is not stored."
    )
    allow_host: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="Additional host names of this server, separated by commas."
    )
    behind_proxy: bool = Field(default=False, description="Trust the X-Forwarded-… headers of a reverse proxy.")
    root_path: str = Field(
        default="",
        pattern=r"^(/[A-Za-z0-9._~-]+)*$",
        description="Sub-path behind a reverse proxy, for example /hornbill.",
    )
    public_url: str | None = Field(
        default=None,
        pattern=r"^https?://[^\s]+$",
        description="Address of the page for other benches, if it differs from the one listened on.",
    )
    tls_cert: Path | None = Field(default=None, description="Certificate chain, PEM. Enables https.")
    tls_key: Path | None = Field(default=None, description="Private key of the certificate, PEM.")
    bus: str | None = Field(
        default=None,
        description="For `serve`: INTERFACE:CHANNEL, or a recording to play back. For `demo`: auto, or unset.",
    )
    bitrate: int = Field(default=1_000_000, gt=0, description="Bit rate of the bus, bit/s.")
    frame_gap_ms: float | None = Field(
        default=None, ge=0, le=20, description="Pause between the frames of one transfer, ms. Default: none."
    )
    data_dir: Path = Field(
        default_factory=lambda: user_data_path("hornbill"),
        description="Data folder: database, logs and recordings. Default: the system's folder for user data.",
    )
    database: str | None = Field(
        default=None,
        repr=False,
        description="Database URL, in place of a file in the data folder. May contain a password.",
    )
    bench: str | None = Field(
        default=None,
        min_length=1,
        max_length=64,
        pattern=r"^[^\s\x00-\x1f\x7f]([^\x00-\x1f\x7f]*[^\s\x00-\x1f\x7f])?$",
        description="Name of this bench in a shared database. Default: the only bench in the data folder, otherwise "
        "the host name.",
    )
    node_id: int = Field(
        default=127, ge=1, le=127, description="Node ID of hornbill. 126 and 127 are reserved for tools."
    )
    allocator: Literal["on", "off", "force"] | None = Field(
        default=None, description="Node ID allocator. force: allocate even if there is another. Default: last setting."
    )
    role: ConnectionRoleChoice | None = Field(
        default=None,
        description="Connection role. auto: listen first, then guest beside an autopilot, otherwise host. Default: "
        "last used with the adapter, otherwise auto.",
    )
    recording_before_s: float = Field(
        default=60.0, ge=30, le=600, description="Time that a recording covers before its first trigger, s."
    )
    position_unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None = Field(
        default=None, description="Unit of positions on the bus, for all servos. Default: measured."
    )
    poll_budget_pct: float = Field(
        default=40.0, ge=1, le=80, description="Bus budget: share of the bus for polling, %."
    )
    telemetry_minutes: float = Field(default=10.0, gt=0, le=120, description="Retention of telemetry, minutes.")
    view: bool = Field(default=True, description="Enable the 3D view.")
    servos: int = Field(default=6, ge=1, le=100, description="Number of simulated servos of `demo`.")
    autopilot: Literal["ardupilot", "px4"] | None = Field(
        default=None, description="Simulated autopilot of `demo`: armed, it moves the servos that have a servo ID."
    )
    seed: int = Field(default=1, description="Random seed of the simulated servos.")
    chaos: int | None = Field(
        default=None, description="Seed of faults that `demo` injects into its servos at random. Default: none."
    )
    speed: Literal["max"] | float | None = Field(
        default=None,
        description="Speed of `demo` relative to real time, or max for as fast as possible. Default: real time.",
    )
    sim_api: bool = Field(default=False, description="Allow simulated servos to be added over REST.")

    @property
    def tls(self) -> tuple[Path, Path] | None:
        """Certificate and key, if both are given."""
        return None if self.tls_cert is None or self.tls_key is None else (self.tls_cert, self.tls_key)

    @field_validator("allow_host", mode="before")
    @classmethod
    def _names(cls, value: object) -> object:
        """Names in lower case, as browsers send them."""
        if isinstance(value, str):
            value = value.split(",")
        if not isinstance(value, (list, tuple)):
            return value
        names = [str(one).strip().lower() for one in cast("Sequence[object]", value)]
        return tuple(name for name in names if name)

    @field_validator("speed")
    @classmethod
    def _possible_speed(cls, value: float | str | None) -> float | str | None:
        """Above 0 and up to MAX_SPEED."""
        if isinstance(value, float) and not 0 < value <= MAX_SPEED:
            raise ValueError(f"{value:g} is outside the speeds above 0 to {MAX_SPEED:g}. Enter such a number, or max.")
        return value

    @field_validator("speed", mode="before")
    @classmethod
    def _speed_or_max(cls, value: object) -> object:
        if not isinstance(value, str) or value == "max":
            return value
        try:
            return float(value)
        except ValueError:
            raise ValueError(f"{value!r} is not a speed. Enter a number above 0, or max.") from None

    @field_validator("root_path", mode="before")
    @classmethod
    def _no_slash_at_the_end(cls, value: object) -> object:
        return value.rstrip("/") if isinstance(value, str) else value

    @field_validator("token")
    @classmethod
    def _no_empty_token(cls, value: SecretStr | None) -> SecretStr | None:
        """Reject an empty HORNBILL_TOKEN: it was probably left unset by mistake."""
        if value is not None and not value.get_secret_value().strip():
            raise ValueError("The token is empty. Set a token, or unset the variable.")
        return value
