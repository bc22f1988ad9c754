"""Profiles: named sets of values. The unit of 0x36 determines its meaning (section 4.30)."""

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from hornbill.domain.fields import STRICT, Utc
from hornbill.schema.scale import Value

Name = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^/\\\x00-\x1f]+$")]


@dataclass(frozen=True, slots=True, kw_only=True, config=STRICT)
class Profile:
    """A named set of values, in engineering units."""

    name: Name = Field(description="Name of the profile.")
    description: str = Field(default="", max_length=1000, description="Purpose of the profile.")
    model: str | None = Field(default=None, description="Model it is made for. Null for any.")
    firmware: str | None = Field(default=None, description="Firmware it is made for, such as `1.300`. Null for any.")
    schema_revision: str = Field(description="Revision of the parameter tables at the time of writing.")
    values: dict[str, Value] = Field(description="Values by key.")
    units: dict[str, str] = Field(description="Units of the values, by key.")
    created_at: Utc
    updated_at: Utc
