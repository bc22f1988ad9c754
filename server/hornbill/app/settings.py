"""What flags and HORNBILL_… environment variables decide, once, at start."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, cast

from platformdirs import user_data_path
from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict


class Settings(BaseSettings):
    """Frozen; flags given by the command line win over the environment."""

    model_config = SettingsConfigDict(env_prefix="HORNBILL_", frozen=True, extra="ignore")

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on; 0 for any")
    token: SecretStr | None = Field(
        default=None, description="a token for admin that is kept nowhere, beside those of 'hornbill token add'"
    )
    allow_host: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="names under which it is reached, beside those of this machine; with commas between"
    )
    behind_proxy: bool = Field(
        default=False, description="whether a reverse proxy is in front, whose X-Forwarded-… headers are believed"
    )
    root_path: str = Field(
        default="", pattern=r"^(/[A-Za-z0-9._~-]+)*$", description="where a reverse proxy puts us, as /hornbill"
    )
    tls_cert: Path | None = Field(default=None, description="certificate chain, PEM")
    tls_key: Path | None = Field(default=None, description="its private key, PEM")
    bus: str | None = Field(
        default=None, description="for `serve`: INTERFACE:CHANNEL, or a recording; for `demo`: auto or nothing"
    )
    bitrate: int = Field(default=1_000_000, gt=0, description="of the bus, bit/s")
    frame_gap_ms: float | None = Field(
        default=None, ge=0, le=20, description="pause between the frames of one transfer, ms; none unless given"
    )
    data_dir: Path = Field(
        default_factory=lambda: user_data_path("hornbill"),
        description="folder of the database, logs and recordings; the system's place for a user's data unless told",
    )
    database: str | None = Field(
        default=None,
        repr=False,
        description="URL of a database instead of a file in the data folder; may hold a password",
    )
    node_id: int = Field(default=127, ge=1, le=127, description="our own node id; 126 and 127 are for tools")
    allocator: Literal["on", "off", "force"] | None = Field(
        default=None, description="node-id allocator; force: also beside another allocator; as chosen last unless told"
    )
    recording_before_s: float = Field(
        default=60.0, ge=30, le=600, description="seconds that a recording covers before its first trigger"
    )
    position_unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None = Field(
        default=None, description="what position 1.0 means on every servo; measured unless told"
    )
    poll_budget_pct: float = Field(default=40.0, ge=1, le=80, description="share of the bus all polling may take, in %")
    telemetry_minutes: float = Field(default=10.0, gt=0, le=120, description="how much of every channel is kept")
    view: bool = Field(default=True, description="whether to start the 3D view")
    servos: int = Field(default=6, ge=1, le=100, description="number of simulated servos of `demo`")
    seed: int = Field(default=1, description="of everything random in them")
    sim_api: bool = Field(default=False, description="whether simulated servos can be added to the bus that is served")

    @field_validator("allow_host", mode="before")
    @classmethod
    def _names(cls, value: object) -> object:
        """Lower case, as browsers send them."""
        if isinstance(value, str):
            value = value.split(",")
        if not isinstance(value, (list, tuple)):
            return value
        names = [str(one).strip().lower() for one in cast("Sequence[object]", value)]
        return tuple(name for name in names if name)

    @field_validator("root_path", mode="before")
    @classmethod
    def _no_slash_at_the_end(cls, value: object) -> object:
        return value.rstrip("/") if isinstance(value, str) else value

    @field_validator("token")
    @classmethod
    def _no_empty_token(cls, value: SecretStr | None) -> SecretStr | None:
        """An empty HORNBILL_TOKEN is one somebody forgot to fill in, not a wish for none."""
        if value is not None and not value.get_secret_value().strip():
            raise ValueError("the token is empty: give one, or leave it out")
        return value
