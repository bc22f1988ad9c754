"""Commands, routes, files, options and variables named in guides, READMEs and messages exist, run here or not."""

import ast
import json
import re
import shlex
import subprocess
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer

from commands.guides import ROOT, blocks, guides
from contract.document_server import document
from contract.source import nodes
from hornbill.api.openapi.sharing import parameters_of
from hornbill.app.settings import Settings
from hornbill.cli import app

PACKAGE = ROOT / "server" / "hornbill"
PAGES = [
    *(file for file in guides() if "reference/api" not in file.as_posix()),
    *sorted(PACKAGE.glob("*/README.md")),
]
COMMAND: Any = typer.main.get_command(app)
USAGE: Any = typer.BadParameter.__base__
"""Raised by Typer for arguments it rejects, also for missing parameters."""
NOT_IN_THE_DOCUMENT = {"/metrics", "/openapi.json", "/ws"}
FOLDERS = ("", "web/src", "server/hornbill", "tests", "docs", "schemas", "server")
"""Where a path in a page may start."""
BUILT = {"dist/", "docs/dist/", "node_modules/"}
EXAMPLE_FILES = {"bench.toml"}
OTHER_OPTIONS = {
    "--device": "Docker", "--no-healthcheck": "Docker", "--network": "Docker", "--upgrade": "pip",
    "--install-completion": "Typer",
    "--hornbill-url": "pytest", "--hornbill-servo": "pytest", "--hornbill-sim": "pytest",
}  # fmt: skip


def inline(page: Path) -> list[str]:
    """The code spans of a page, without its blocks."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return [re.sub(r"\s+", " ", found).replace("\\|", "|") for found in re.findall(r"(?<!`)`([^`]+)`(?!`)", text)]


def commands(shell: str) -> Iterator[list[str]]:
    """The arguments of each `hornbill` in a shell script, also of one inside a container."""
    for line in shell.replace("\\\n", " ").splitlines():
        try:
            lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
            lexer.whitespace_split = True
            words = list(lexer)
        except ValueError:  # a quotation continues on the next line: no hornbill command does
            continue
        simple: list[str] = []
        for word in [*words, ";"]:
            if set(word) <= set("();<>|&"):
                yield from _hornbill(simple)
                simple = []
            else:
                simple.append(word)


def _hornbill(words: list[str]) -> Iterator[list[str]]:
    if words[:1] == ["hornbill"]:
        yield words[1:]
    elif words[:2] == ["docker", "run"] and "hornbill" in words:
        yield words[words.index("hornbill") + 1 :] or ["demo"]
    elif words[:3] == ["docker", "compose", "exec"] and words[4:5] == ["hornbill"]:
        yield words[5:]


def command_error(arguments: list[str], *, complete: bool) -> str:
    """Why the command line rejects a command; empty if it accepts it. Unless `complete`, arguments may be missing."""
    command: Any = COMMAND
    rest = [one for one in arguments if complete or one not in ("…", "...")]
    while hasattr(command, "commands") and rest and not rest[0].startswith("-"):
        word = rest.pop(0)
        if word not in command.commands:
            return f"there is no command {word}"
        command = command.commands[word]
    if hasattr(command, "commands") and not command.invoke_without_command:
        return "" if not complete or rest in (["--help"], ["--install-completion"]) else "which command?"
    try:
        command.make_context("hornbill", rest)
    except typer.Exit:  # --help
        return ""
    except USAGE as error:
        message = str(error.format_message())
        missing = type(error).__name__ == "MissingParameter" or "requires an argument" in message
        return "" if (missing and not complete) or message.endswith("does not exist.") else message
    return ""


@cache
def operations() -> dict[tuple[str, str], set[str]]:
    """Method and path of every operation, and its query parameters."""
    return {
        (verb.upper(), path.removeprefix("/api/v1")): {one["name"] for one in parameters_of(document(), operation)}
        for path, verbs in document()["paths"].items()
        for verb, operation in verbs.items()
    }


def matches(method: str, path: str) -> list[tuple[str, str]]:
    """The operations a route may name: `{uid}`, `UID` and `$U` stand for anything, a leading … for any beginning."""
    anything = r"(\{\w+\}|[A-Z_]{2,}|\$\w+)"
    parts = [r"[^/]+" if re.fullmatch(anything, part) else re.escape(part) for part in path.strip("/").split("/")]
    begins = "(.*/)?" if path.startswith("…") else "/"
    pattern = begins + "/".join(parts[1:] if path.startswith("…") else parts)
    return [(verb, known) for verb, known in operations() if verb == method and re.fullmatch(pattern, known)]


@cache
def options() -> set[str]:
    """Every option of every command, and those of other programs that guides show."""

    def of(command: Any) -> set[str]:
        found = {name for one in command.params for name in (*one.opts, *one.secondary_opts)}
        return found.union(*map(of, getattr(command, "commands", {}).values()))

    return of(COMMAND) | OTHER_OPTIONS.keys()


@cache
def variables() -> set[str]:
    """Every environment variable that the product, its tests or its checks read."""
    found = {f"HORNBILL_{name.upper()}" for name in Settings.model_fields}
    for folder in ("server/hornbill", "tests", ".ci"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", "") and file.is_file() and file != Path(__file__):
                found |= set(re.findall(r"\bHORNBILL_[A-Z_]+[A-Z]\b", file.read_text(encoding="utf-8")))
    return found


@cache
def file_names() -> set[str]:
    """The name of every file of the checkout; empty outside git."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout
    return {Path(line).name for line in listed.splitlines() if (ROOT / line).exists()}


def wrong_commands(page: Path) -> Iterator[str]:
    for block in blocks(page):
        for one in commands(block.script):
            if error := command_error(one, complete=True):
                yield f"{block}: hornbill {shlex.join(one)}: {error}"
    for text in inline(page):
        for one in commands(text):
            if not any(map(str.isupper, one[:1])) and (error := command_error(one, complete=False)):
                yield f"`{text}`: {error}"


def wrong_routes(page: Path) -> Iterator[str]:
    for text in inline(page):
        for method, url in re.findall(r"\b(GET|PUT|POST|PATCH|DELETE) ([/…]\S*)", text):
            path, _, query = url.partition("?")
            path = path.replace("$API", "").removeprefix("/api/v1")
            names = {part.partition("=")[0] for part in query.split("&") if part}
            if path not in NOT_IN_THE_DOCUMENT and not any(names <= operations()[one] for one in matches(method, path)):
                yield f"{method} {url}"


def wrong_files(page: Path) -> Iterator[str]:
    places = [page.parent, *(ROOT / folder for folder in FOLDERS)]
    for text in inline(page):
        is_file = re.fullmatch(r"[\w./-]+\.(py|ts|tsx|toml|md|yaml|json|css|mts)", text)
        if is_file and "/" in text:
            if not any((place / text).exists() for place in places):
                yield f"file {text}"
        elif page.name != "README.md":
            continue
        elif is_file and page.parent != ROOT:
            if file_names() and text not in file_names() | EXAMPLE_FILES:
                yield f"file {text}"
        elif re.fullmatch(r"[\w.-][\w./-]*/", text) and text not in BUILT:
            yield from () if any((place / text).is_dir() for place in places) else (f"folder {text}",)


def wrong_names(page: Path) -> Iterator[str]:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for text in inline(page):
        yield from (f"make {one}" for one in re.findall(r"^make ([a-z-]+)", text) if one not in targets)
        if text.startswith("--") and text.split()[0].split("=")[0] not in options():
            yield f"option {text}"
    if page.name != "CHANGELOG.md":  # names variables that were removed
        named = re.findall(r"\bHORNBILL_[A-Z_]+[A-Z]\b", page.read_text(encoding="utf-8"))
        yield from (f"variable {name}" for name in named if name not in variables())


@pytest.mark.parametrize("page", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_everything_a_page_names_exists(page: Path) -> None:
    assert [*wrong_commands(page), *wrong_routes(page), *wrong_files(page), *wrong_names(page)] == []


def messages() -> Iterator[tuple[str, str]]:
    """Every text in the server's code with its place; `{uid}` stands for inserted values."""
    for file in sorted(PACKAGE.rglob("*.py")):
        inner = {id(part) for each in nodes(file) if isinstance(each, ast.JoinedStr) for part in each.values}
        for each in nodes(file):
            place = f"{file.relative_to(ROOT)}:{getattr(each, 'lineno', 0)}"
            if isinstance(each, ast.JoinedStr):
                parts = [str(one.value) if isinstance(one, ast.Constant) else "{uid}" for one in each.values]
                yield place, "".join(parts)
            elif isinstance(each, ast.Constant) and isinstance(each.value, str) and id(each) not in inner:
                yield place, each.value


def test_every_route_in_a_message_exists() -> None:
    wrong = [
        f"{place}: {method} {path}"
        for place, text in messages()
        for method, path in re.findall(r"\b(GET|PUT|POST|PATCH|DELETE) (?:/api/v1)?([/…][^\s\"'`,;:)?.]*)", text)
        if path not in NOT_IN_THE_DOCUMENT and not matches(method, path.replace("{}", "{uid}"))
    ]
    assert wrong == []


def test_the_table_of_mutation_tests_names_existing_files() -> None:
    table = tomllib.loads((ROOT / "tests" / "mutation" / "modules.toml").read_text(encoding="utf-8"))
    names = [f"server/{name}" for entry in table.values() for name in entry["modules"]]
    names += [name.partition("::")[0] for entry in table.values() for name in entry["tests"]]
    assert [name for name in names if not (ROOT / name).is_file()] == []


def test_the_image_starts_with_a_valid_command() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    (entry,), (words,) = (re.findall(rf"^{name} (\[.*\])$", text, re.MULTILINE) for name in ("ENTRYPOINT", "CMD"))
    assert json.loads(entry) == ["hornbill"]
    assert command_error(json.loads(words), complete=True) == ""
