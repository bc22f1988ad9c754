"""Owns GET /schema: the whole catalogue, for forms and programs."""

from fastapi import APIRouter

from hornbill.api import PREFIX
from hornbill.api.models import Model
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import EffectRule
from hornbill.schema.fault import FaultBit
from hornbill.schema.parameter import Group, Parameter


class RowRange(Model):
    """What one model allows in one row, raw."""

    default: int | None
    minimum: int | None
    maximum: int | None


class SchemaModel(Model):
    """One servo model and its own numbers; `rows` has every row it offers at its newest firmware."""

    name: str
    series: str
    pwm: bool
    model_number: int
    hardware_version: int
    voltage_class: str
    rows: dict[str, RowRange]


class SchemaDocument(Model):
    """Every table: rows, models, firmware steps, fault bits, effect rules."""

    revision: str
    specification: str
    firmware: list[str]
    groups: list[Group]
    parameters: list[Parameter]
    models: list[SchemaModel]
    overview: list[FaultBit]
    faults: list[FaultBit]
    effects: list[EffectRule]


def document(catalog: Catalog) -> SchemaDocument:
    """The catalogue as JSON; rows nobody may touch (0x49) and actions are left out."""
    return SchemaDocument(
        revision=catalog.revision,
        specification=catalog.specification,
        firmware=list(catalog.firmware_steps),
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
                rows={key: RowRange.model_validate(row) for key, row in model.rows().items()},
            )
            for model in catalog.models.values()
        ],
        overview=list(catalog.overview),
        faults=list(catalog.faults),
        effects=list(catalog.effects),
    )


def router(catalog: Catalog) -> APIRouter:
    """The one route; the document is made once, for it never changes while the server runs."""
    made = APIRouter(prefix=PREFIX, tags=["schema"])
    whole = document(catalog)

    @made.get("/schema", operation_id="get_schema")
    async def get_schema() -> SchemaDocument:
        """The whole parameter catalogue."""
        return whole

    return made
