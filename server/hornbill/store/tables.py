"""Owns the tables as they are now. Changing one takes a migration beside it.

Instants are float seconds since 1970 in UTC, everywhere in the database.
"""

from typing import TypeAlias

from sqlalchemy import JSON, Boolean, Float, Integer, MetaData, String
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

_INSTANT = Float(53)


class Table(DeclarativeBase):
    """What every table shares: names for constraints, so that migrations can find them on any database."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(column_0_label)s",
            "uq": "uq_%(table_name)s_%(column_0_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
        }
    )


class AllocationRow(Table):
    """A node id that belongs to a unique id; no id belongs to two."""

    __tablename__ = "allocations"

    uid: Mapped[str] = mapped_column(String(32), primary_key=True)
    node_id: Mapped[int] = mapped_column(Integer, unique=True)
    pinned: Mapped[bool] = mapped_column(Boolean)
    first_seen: Mapped[float | None] = mapped_column(_INSTANT)
    last_seen: Mapped[float | None] = mapped_column(_INSTANT)


class ServoRow(Table):
    """A servo that was met once: what it is called, what it said of itself, what its ROM held last."""

    __tablename__ = "servos"

    uid: Mapped[str] = mapped_column(String(32), primary_key=True)
    label: Mapped[str] = mapped_column(String(200))
    name: Mapped[str | None] = mapped_column(String(80))
    model: Mapped[str | None] = mapped_column(String(40))
    model_number: Mapped[int | None] = mapped_column(Integer)
    hardware_version: Mapped[int | None] = mapped_column(Integer)
    firmware: Mapped[int | None] = mapped_column(Integer)
    serial: Mapped[int | None] = mapped_column(Integer)
    production_date: Mapped[str | None] = mapped_column(String(40))
    node_id: Mapped[int | None] = mapped_column(Integer)
    servo_id: Mapped[int | None] = mapped_column(Integer)
    bus: Mapped[str | None] = mapped_column(String(200))
    first_seen: Mapped[float | None] = mapped_column(_INSTANT)
    last_seen: Mapped[float | None] = mapped_column(_INSTANT)
    rom: Mapped[dict[str, int]] = mapped_column(JSON)


class SettingRow(Table):
    """One value of ours, as JSON, under a name."""

    __tablename__ = "settings"

    key: Mapped[str] = mapped_column(String(100), primary_key=True)
    value: Mapped[Json] = mapped_column(JSON, nullable=False)
