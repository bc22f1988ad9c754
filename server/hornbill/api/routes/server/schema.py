"""The complete parameter catalogue, and the OpenAPI document."""

import asyncio
import gzip
from functools import cache
from hashlib import sha256

import orjson
from fastapi import Request, Response
from pydantic import Field

from hornbill import resources
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import EffectRule
from hornbill.schema.fault import FaultBit
from hornbill.schema.parameter import Group, Parameter


class RowRange(Model):
    """Range of one row in one model, raw."""

    default: int | None = Field(description="Default, raw.")
    minimum: int | None = Field(description="Minimum, raw.")
    maximum: int | None = Field(description="Maximum, raw.")


class SchemaModel(Model):
    """One servo model."""

    name: str = Field(description="Model name.")
    series: str = Field(description="BLA15, BLA21 or BLA34.")
    pwm: bool = Field(description="The model has a PWM input.")
    model_number: int = Field(description="Model number as read from the servo.")
    hardware_version: int = Field(description="Hardware version from GetNodeInfo.")
    voltage_class: str = Field(description="Supply voltage class.")
    firmware: list[str] = Field(description="Firmware versions of this model.")
    rows: dict[str, RowRange] = Field(description="Ranges of the rows of its newest firmware, by key.")


class SchemaDocument(Model):
    """All tables: rows, models, firmware versions, fault bits, effect rules."""

    revision: str = Field(description="Revision of the tables.")
    specification: str = Field(description="Document the tables are made from.")
    firmware: list[str] = Field(description="Known firmware versions.")
    firmware_notes: dict[str, str] = Field(description="Notes for users of a firmware, by version.")
    groups: list[Group] = Field(description="Groups of the parameter list.")
    parameters: list[Parameter] = Field(description="All rows.")
    models: list[SchemaModel] = Field(description="Models with their ranges.")
    overview: list[FaultBit] = Field(description="Bits of the summary register.")
    faults: list[FaultBit] = Field(description="Bits of the three fault registers.")
    effects: list[EffectRule] = Field(description="Conditions under which rows have no effect.")


def document(catalog: Catalog) -> SchemaDocument:
    """Catalogue as JSON, without forbidden rows (0x49) and actions."""
    return SchemaDocument(
        revision=catalog.revision,
        specification=catalog.specification,
        firmware=list(catalog.firmware_steps),
        firmware_notes={step.version: step.note for step in catalog.firmware},
        groups=list(catalog.groups),
        parameters=list(catalog.readable.values()),
        models=[
            SchemaModel(
                name=model.name,
                series=model.series,
                pwm=model.pwm,
                model_number=model.model_number,
                hardware_version=model.hardware_version,
                voltage_class=model.voltage_class,
                firmware=list(model.firmware),
                rows={key: RowRange.model_validate(row) for key, row in model.rows().items()},
            )
            for model in catalog.models.values()
        ],
        overview=list(catalog.overview),
        faults=list(catalog.faults),
        effects=list(catalog.effects),
    )


def routes(catalog: Catalog) -> Routes:
    """Routes of the catalogue, which is built once because it never changes while the server runs."""
    made = Routes("schema")
    whole = document(catalog)

    @made.get("/schema", Role.VIEW)
    async def get_schema() -> SchemaDocument:
        """Get the complete parameter catalogue."""
        return whole

    @made.get("/openapi.json", Role.VIEW, include_in_schema=False)
    async def get_openapi(request: Request) -> Response:
        packed, tag = await asyncio.to_thread(_openapi, str(request.scope.get("root_path", "")))
        headers = {"ETag": tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        if "gzip" in request.headers.get("accept-encoding", ""):
            return Response(packed, headers={**headers, "Content-Encoding": "gzip"}, media_type="application/json")
        return Response(
            await asyncio.to_thread(gzip.decompress, packed), headers=headers, media_type="application/json"
        )

    return made


@cache
def _openapi(root_path: str) -> tuple[bytes, str]:
    """The generated document, compressed, and its ETag. `root_path`: sub-path of a reverse proxy.

    Making it from the routes would take a second, during which nothing else runs, and 20 MB.
    """
    text = resources.openapi().read_bytes()
    if root_path:
        text = b'{"servers": ' + orjson.dumps([{"url": root_path}]) + b"," + text.removeprefix(b"{")
    return gzip.compress(text, mtime=0), f'W/"{sha256(text).hexdigest()[:32]}"'
