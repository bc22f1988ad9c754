"""What guides say in passing is so: commands, routes, variables, targets and files they name exist, run here or not."""

import ast
import json
import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer

from commands.guides import ROOT, blocks, guides
from contract.answering import document
from contract.source import nodes
from hornbill.api.openapi.sharing import parameters_of
from hornbill.app.settings import Settings
from hornbill.cli import app

PAGES = [file for file in guides() if "reference/api" not in file.as_posix()]
COMMAND: Any = typer.main.get_command(app)
USAGE: Any = typer.BadParameter.__base__
"""What Typer raises for words it does not take; its missing parameters are of it, too."""
NOT_IN_THE_DOCUMENT = {"/metrics", "/openapi.json", "/ws"}
BEFORE_FILES = ("", "web/src", "server/hornbill", "tests", "docs", "schemas", "server")
"""Where a file that a guide names may begin."""
OTHERS_OPTIONS = {
    "--device": "Docker", "--no-healthcheck": "Docker", "--network": "Docker", "--upgrade": "pip",
    "--install-completion": "Typer",
    "--hornbill-url": "pytest", "--hornbill-servo": "pytest", "--hornbill-sim": "pytest",
}  # fmt: skip


def inline(page: Path) -> list[str]:
    """What stands between backticks in the running text and tables of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return [re.sub(r"\s+", " ", found).replace("\\|", "|") for found in re.findall(r"(?<!`)`([^`]+)`(?!`)", text)]


def commands(shell: str) -> Iterator[list[str]]:
    """The arguments of each `hornbill` in a piece of shell, also of one inside a container."""
    for line in shell.replace("\\\n", " ").splitlines():
        try:
            lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
            lexer.whitespace_split = True
            words = list(lexer)
        except ValueError:  # a quotation goes on in the next line: no command of ours does
            continue
        simple: list[str] = []
        for word in [*words, ";"]:
            if set(word) <= set("();<>|&"):
                yield from _ours(simple)
                simple = []
            else:
                simple.append(word)


def _ours(words: list[str]) -> Iterator[list[str]]:
    if words[:1] == ["hornbill"]:
        yield words[1:]
    elif words[:2] == ["docker", "run"] and "hornbill" in words:
        yield words[words.index("hornbill") + 1 :] or ["demo"]
    elif words[:3] == ["docker", "compose", "exec"] and words[4:5] == ["hornbill"]:
        yield words[5:]


def known(arguments: list[str], whole: bool) -> str:
    """What is wrong with a command; nothing when it is one. Unless `whole`, it may leave out what it would need."""
    command: Any = COMMAND
    rest = [one for one in arguments if whole or one not in ("…", "...")]
    while hasattr(command, "commands") and rest and not rest[0].startswith("-"):
        word = rest.pop(0)
        if word not in command.commands:
            return f"there is no command {word}"
        command = command.commands[word]
    if hasattr(command, "commands"):
        return "" if not whole or rest in (["--help"], ["--install-completion"]) else "which command?"
    try:
        command.make_context("hornbill", rest)
    except typer.Exit:  # --help
        return ""
    except USAGE as error:
        told = str(error.format_message())
        missing = type(error).__name__ == "MissingParameter" or "requires an argument" in told
        return "" if (missing and not whole) or told.endswith("does not exist.") else told
    return ""


@cache
def operations() -> dict[tuple[str, str], set[str]]:
    """Method and path of every operation, and the query parameters it takes."""
    made = document()
    return {
        (verb.upper(), path.removeprefix("/api/v1")): {one["name"] for one in parameters_of(made, operation)}
        for path, verbs in made["paths"].items()
        for verb, operation in verbs.items()
    }


def matches(method: str, path: str) -> list[tuple[str, str]]:
    """The operations a guide may mean: `{uid}`, `UID` and `$U` stand for anything, a leading … for any beginning."""
    anything = r"(\{\w+\}|[A-Z_]{2,}|\$\w+)"
    parts = [r"[^/]+" if re.fullmatch(anything, part) else re.escape(part) for part in path.strip("/").split("/")]
    begins = "(.*/)?" if path.startswith("…") else "/"
    pattern = begins + "/".join(parts[1:] if path.startswith("…") else parts)
    return [(verb, known) for verb, known in operations() if verb == method and re.fullmatch(pattern, known)]


@pytest.mark.parametrize("page", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_command_of_ours_is_one_the_command_line_takes(page: Path) -> None:
    wrong: list[str] = []
    for block in blocks(page):
        wrong += [f"{block}: hornbill {shlex.join(one)}: {known(one, True)}" for one in commands(block.script)
                  if known(one, True)]  # fmt: skip
    for text in inline(page):
        for one in commands(text):
            if not any(map(str.isupper, one[:1])) and known(one, False):
                wrong.append(f"`{text}`: {known(one, False)}")
    assert wrong == []


@pytest.mark.parametrize("page", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_route_a_guide_names_is_there_with_the_query_it_shows(page: Path) -> None:
    wrong: list[str] = []
    for text in inline(page):
        for method, url in re.findall(r"\b(GET|PUT|POST|PATCH|DELETE) ([/…]\S*)", text):
            path, _, query = url.partition("?")
            path = path.replace("$API", "").removeprefix("/api/v1")
            if path in NOT_IN_THE_DOCUMENT:
                continue
            found = matches(method, path)
            names = {part.partition("=")[0] for part in query.split("&") if part}
            if not found or not any(names <= operations()[one] for one in found):
                wrong.append(f"{method} {url}")
    assert wrong == []


def messages() -> Iterator[tuple[str, str]]:
    """Every text in the server's code with its place; what is filled in is `{uid}`."""
    for file in sorted((ROOT / "server/hornbill").rglob("*.py")):
        inner = {id(part) for each in nodes(file) if isinstance(each, ast.JoinedStr) for part in each.values}
        for each in nodes(file):
            place = f"{file.relative_to(ROOT)}:{getattr(each, 'lineno', 0)}"
            if isinstance(each, ast.JoinedStr):
                parts = [str(one.value) if isinstance(one, ast.Constant) else "{uid}" for one in each.values]
                yield place, "".join(parts)
            elif isinstance(each, ast.Constant) and isinstance(each.value, str) and id(each) not in inner:
                yield place, each.value


def test_every_route_a_message_names_is_there() -> None:
    wrong = [
        f"{place}: {method} {path}"
        for place, text in messages()
        for method, path in re.findall(r"\b(GET|PUT|POST|PATCH|DELETE) (?:/api/v1)?([/…][^\s\"'`,;:)?.]*)", text)
        if path not in NOT_IN_THE_DOCUMENT and not matches(method, path.replace("{}", "{uid}"))
    ]
    assert wrong == []


@pytest.mark.parametrize("page", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_file_target_option_and_variable_a_guide_names_is_there(page: Path) -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    wrong: list[str] = []
    for text in inline(page):
        if re.fullmatch(r"[\w./-]+/[\w.-]+\.(py|ts|tsx|toml|md|yaml|json|css|mts)", text):
            places = [page.parent, *(ROOT / folder for folder in BEFORE_FILES)]
            if not any((place / text).exists() for place in places):
                wrong.append(f"file {text}")
        wrong += [f"make {one}" for one in re.findall(r"^make ([a-z]+)", text) if one not in targets]
        if text.startswith("--") and text.split()[0].split("=")[0] not in options():
            wrong.append(f"option {text}")
    if page.name != "CHANGELOG.md":  # which tells of those that are gone
        named = re.findall(r"\bHORNBILL_[A-Z_]+[A-Z]\b", page.read_text(encoding="utf-8"))
        wrong += [f"variable {name}" for name in named if name not in variables()]
    assert wrong == []


@cache
def options() -> set[str]:
    """Every option of every command, and those of others that guides show."""
    found = set(OTHERS_OPTIONS)

    def look(command: Any) -> None:
        for one in command.params:
            found.update([*one.opts, *one.secondary_opts])
        for each in getattr(command, "commands", {}).values():
            look(each)

    look(COMMAND)
    return found


@cache
def variables() -> set[str]:
    """Every environment variable that something of ours reads."""
    found = {f"HORNBILL_{name.upper()}" for name in Settings.model_fields}
    for folder in ("server/hornbill", "tests", ".ci"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", "") and file.is_file() and "test_written" not in file.name:
                found |= set(re.findall(r"\bHORNBILL_[A-Z_]+[A-Z]\b", file.read_text(encoding="utf-8")))
    return found


def test_what_is_wrong_is_found() -> None:
    assert known(["serve", "--bsu", "x"], True)
    assert known(["set", "61-466861"], True)
    assert known(["nothing"], False)
    assert known(["get"], False) == ""
    assert known(["logs", "start", "--name", "x"], True) == ""
    assert list(commands("sudo x && hornbill list --json | jq . ; docker run -p 1:1 hornbill demo --bus auto")) == [
        ["list", "--json"], ["demo", "--bus", "auto"],
    ]  # fmt: skip
    assert matches("POST", "/servos/{uid}/savee") == []
    assert matches("GET", "…/telemetry")
    assert matches("GET", "/jobs/ID")
    assert "HORNBILL_NO_SUCH" + "_THING" not in variables()


def test_the_image_starts_with_words_the_command_line_takes() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    (entry,), (words,) = (re.findall(rf"^{name} (\[.*\])$", text, re.MULTILINE) for name in ("ENTRYPOINT", "CMD"))
    assert json.loads(entry) == ["hornbill"]
    assert known(json.loads(words), True) == ""
