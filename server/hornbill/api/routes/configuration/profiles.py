"""Routes of profiles: create, change, export, import and apply."""

import re
from dataclasses import asdict
from typing import Annotated
from urllib.parse import quote

from fastapi import Header, Path, Query, Request
from pydantic import Field
from starlette.responses import Response

from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.paging import Every
from hornbill.api.routes.server.jobs import Wait, job_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import LineVerdict
from hornbill.domain.fields import DryRun, Model, OnAnomaly, SafetyConfirm, SaveAfter
from hornbill.domain.profile import Name, Profile
from hornbill.errors import InvalidValue
from hornbill.servo.host import Host
from hornbill.servo.profiles import profile_file
from hornbill.servo.profiles.profile_file import Form
from hornbill.servo.profiles.profiles import Draft
from hornbill.servo.runs.apply import ApplyOptions
from hornbill.units import Uid

routes = Routes("profiles")


class ProfilePut(Model):
    """Profile to store: its values, or the servo or snapshot to take them from."""

    description: str = Field(default="", max_length=1000, description="Purpose of the profile.")
    model: str | None = Field(default=None, description="Model it is made for. Null for any.")
    firmware: str | None = Field(default=None, description="Firmware it is made for, such as `1.300`. Null for any.")
    values: dict[str, bool | int | float | str] | None = Field(
        default=None, min_length=1, max_length=200, description="Values by key, in the units of the parameter manual."
    )
    units: dict[str, str] | None = Field(
        default=None, max_length=200, description="Units of the values, by key. Null for the units of the tables."
    )
    from_uid: ServoRef | None = Field(default=None, description="Servo to take the values from.")
    from_snapshot: int | None = Field(default=None, description="ID of the snapshot to take the values from.")
    keys: list[str] | None = Field(
        default=None, description="Keys of the rows to store. Null for all rows but identity."
    )
    identity: bool = Field(default=False, description="Include the identity rows 0x44 to 0x46.")


class Imported(Model):
    """Result of an import."""

    profile: Profile | None = Field(description="Imported profile. Null unless all lines are ok.")
    lines: list[LineVerdict] = Field(description="Verdict on each line.")


class ProfileApply(Model):
    """Servos to apply a profile to, in this order."""

    uids: list[ServoRef] = Field(min_length=1, max_length=250, description="Servos in the order of writing.")
    dry_run: DryRun = False
    save: SaveAfter = False
    on_anomaly: OnAnomaly = Field(
        default="stop", description="After the first servo with an unexpected result: stop, or continue."
    )
    confirm: SafetyConfirm


LARGEST_FILE = 256 * 1024
"""Maximum size of an imported file, bytes; a profile of all rows has about 3 kB."""

MEDIA_TYPES: dict[Form, str] = {"toml": "application/toml", "json": "application/json"}
VALUE_PROBLEMS = (
    "unknown_parameter",
    "not_in_this_model",
    "read_only",
    "forbidden_parameter",
    "out_of_range",
    "invalid_value",
)
FILE_BODY = {
    "requestBody": {"required": True, "content": {one: {"schema": {"type": "string"}} for one in MEDIA_TYPES.values()}}
}
FILE_RESPONSES = {"content": {one: {"schema": {"type": "string"}} for one in MEDIA_TYPES.values()}}

ProfileName = Annotated[Name, Path(description="Name of the profile, 1 to 80 characters without slash.")]


@routes.get("/profiles", Role.VIEW)
async def list_profiles(host: TheHost, page: Every) -> list[Profile]:
    """List all profiles, by name."""
    return page.of(host.profiles.all(), lambda one: one.name)


@routes.get("/profiles/{name}", Role.VIEW, "unknown_profile", "invalid_value")
async def get_profile(host: TheHost, name: ProfileName) -> Profile:
    """Get a profile."""
    return host.profiles.get(name)


@routes.put(
    "/profiles/{name}",
    Role.CONFIGURE,
    *VALUE_PROBLEMS,
    "unknown_servo",
    "unknown_snapshot",
    "busy",
    "no_response",
    "bus_disconnected",
    "store_failed",
    responses={201: {"model": Profile, "description": "New profile."}},
)
async def put_profile(
    host: TheHost, name: ProfileName, body: ProfilePut, response: Response, lease: LeaseHeader = None
) -> Profile:
    """Store a profile, from given values, a servo or a snapshot. Replaces a profile of the same name."""
    draft = await _draft(host, body)
    response.status_code = 200 if host.profiles.has(name) else 201
    return await host.profiles.put(name, draft, identity=body.identity, by=_who(host, lease))


@routes.delete("/profiles/{name}", Role.CONFIGURE, "unknown_profile", "invalid_value", status_code=204)
async def delete_profile(host: TheHost, name: ProfileName, lease: LeaseHeader = None) -> None:
    """Delete a profile. Servos that it was applied to stay unchanged."""
    await host.profiles.drop(name, by=_who(host, lease))


@routes.get(
    "/profiles/{name}/file",
    Role.VIEW,
    "unknown_profile",
    "invalid_value",
    response_class=Response,
    responses={200: FILE_RESPONSES},
)
async def export_profile(
    host: TheHost,
    name: ProfileName,
    form: Annotated[Form, Query(alias="format", description="File format.")] = "toml",
) -> Response:
    """Export a profile as a file: TOML with label and unit on every line, or JSON."""
    one = host.profiles.get(name)
    text = profile_file.to_toml(one, host.catalog) if form == "toml" else profile_file.to_json(one)
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("._") or "profile"
    named = f"attachment; filename=\"{plain}.{form}\"; filename*=UTF-8''{quote(name, safe='')}.{form}"
    return Response(text, media_type=MEDIA_TYPES[form], headers={"Content-Disposition": named})


@routes.put(
    "/profiles/{name}/file",
    Role.CONFIGURE,
    "invalid_value",
    openapi_extra=FILE_BODY,
    responses={201: {"model": Imported, "description": "New profile."}},
)
async def import_profile(
    host: TheHost,
    name: ProfileName,
    request: Request,
    response: Response,
    identity: Annotated[bool, Query(description="Include identity rows (0x44 to 0x46).")] = False,
    content_type: Annotated[str, Header(include_in_schema=False)] = "",
    lease: LeaseHeader = None,
) -> Imported:
    """Import a profile from a file. If any line is invalid, nothing is stored, and `lines` of the problem contains a
    verdict on each line.
    """
    form = _form(content_type)
    found = profile_file.read(await _text(request), form, host.profiles, host.catalog, identity=identity)
    lines = list(found.lines)
    if found.draft is None:
        wrong = [one for one in lines if one.verdict != "ok"]
        raise InvalidValue(
            f"{len(wrong)} of {len(lines)} lines are invalid. Nothing was imported. "
            f"Line {wrong[0].line}{f', {wrong[0].key[:60]}' if wrong[0].key else ''}: {wrong[0].text}",
            lines=[asdict(one) for one in lines],
            cause="lines_invalid",
            count=len(wrong),
            total_lines=len(lines),
            line=wrong[0].line,
        )
    response.status_code = 200 if host.profiles.has(name) else 201
    stored = await host.profiles.put(name, found.draft, identity=identity, by=_who(host, lease))
    return Imported(profile=stored, lines=lines)


@routes.post(
    "/profiles/{name}/apply",
    Role.CONFIGURE,
    "unknown_profile",
    "unknown_servo",
    "lease_held",
    "conflict",
    "busy",
    "bus_disconnected",
    "invalid_value",
    **starts(),
)
async def apply_profile(
    host: TheHost, name: ProfileName, body: ProfileApply, lease: LeaseHeader = None, wait: Wait = False
) -> Response:
    """Apply a profile to servos one by one, each all or nothing. Rows that a servo lacks are left out and listed."""
    host.connected()
    options = ApplyOptions(body.dry_run, body.save, body.on_anomaly, tuple(body.confirm))
    job = host.profile_jobs.start(name, [Uid(uid) for uid in body.uids], lease, options)
    return await job_response(host, job, wait)


async def _draft(host: Host, body: ProfilePut) -> Draft:
    sources = [one is not None for one in (body.values, body.from_uid, body.from_snapshot)]
    if sum(sources) != 1:
        raise InvalidValue(
            "A profile needs exactly one source. Give one of values, from_uid and from_snapshot.",
            cause="one_source_required",
        )
    if body.values is not None:
        return Draft(body.values, body.description, body.model, body.firmware, body.units)
    if body.from_snapshot is not None:
        snapshot = await host.store.run(host.store.snapshots.get, body.from_snapshot)
        return host.profiles.from_snapshot(
            snapshot, body.keys, identity=body.identity, description=body.description
        )  # fmt: skip
    host.connected()
    servo = host.fleet.get(Uid(body.from_uid or ""))
    return await host.profiles.from_servo(
        host.requests, servo, body.keys, identity=body.identity, description=body.description
    )  # fmt: skip


def _form(content_type: str) -> Form:
    media = content_type.partition(";")[0].strip().lower()
    for form, known in MEDIA_TYPES.items():
        if media == known:
            return form
    raise InvalidValue(
        "The file must be TOML or JSON. Send Content-Type: application/toml or application/json.",
        cause="file_not_toml_or_json",
    )


async def _text(request: Request) -> str:
    """Body as text. Raises InvalidValue if it is too large (before reading all of it) or not UTF-8."""
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > LARGEST_FILE:
            raise InvalidValue(
                f"The file exceeds the limit of {LARGEST_FILE // 1024} kB. A profile usually has a few kB.",
                cause="file_too_large",
                limit_kb=LARGEST_FILE // 1024,
            )
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = body.count(b"\n", 0, error.start) + 1
        raise InvalidValue(
            f"Line {line} is not UTF-8. Save the file as UTF-8.", cause="line_not_utf8", line=line
        ) from None


def _who(host: Host, lease: str | None) -> str:
    return host.leases.who(lease, host.base.now())
