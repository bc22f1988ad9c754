"""List words that the glossary replaces, with file and line.

    python -m tools.words                           every occurrence, then a table by folder
    python -m tools.words server/hornbill/motion    below these paths only
    python -m tools.words -w ask -w "by hand"       these words only, in every form
    python -m tools.words --sure                    without words that also have a proper sense (hold, look, way, …)
    python -m tools.words --summary                 tables only
    python -m tools.words --files                   names of files and folders, too

Identifiers are split at underscores and camel case, so `NoAnswer` and `no_answer` count as "answer". Generated files
and the quotations in `ALLOWED` are excluded.
"""

import argparse
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
PLACES: Final = ("server", "web/src", "tests", "tools", "examples", "docs", "schemas", "docker", ".github", ".")
"""Searched by default. "." stands for the files of the top folder alone."""
ENDINGS: Final = (
    ".py",
    ".ts",
    ".tsx",
    ".css",
    ".md",
    ".toml",
    ".yaml",
    ".yml",
    ".html",
    ".j2",
    ".js",
    ".sh",
    "Makefile",
)

SURE: Final = {
    "answer": ("answer(s|ed|ing|able)?", "response, respond, acknowledge"),
    "ask": ("ask(s|ed|ing)?", "request, read"),
    "tell": ("tell(s|ing)?|told", "publish, notify, report, given"),
    "hear": ("hear(s|ing)?|heard", "receive"),
    "met": ("met", "seen"),
    "wish": ("wish(es|ed|ing)?", "requested rate, subscription"),
    "sign of life": ("signs? of life", "heartbeat"),
    "patience": ("patience|patient|impatient", "timeout, retry policy"),
    "give up": ("(gives?|gave|given|giving) up", "time out"),
    "quench": ("quench(es|ed|ing|er)?", "torque off"),
    "rival": ("rivals?", "competing allocator"),
    "stranger": ("strangers?", "foreign node"),
    "boots": ("boots|lives", "boot count"),
    "crew": ("crews?", "workers"),
    "whoever": ("whoever|whomever", "client, user, operator"),
    "somebody": ("somebody|anybody|everybody", "client, user, another client"),
    "nobody": ("nobody", "none, no one"),
    "time-out": ("time-outs?", "timeout"),
    "dead band": ("dead bands?", "deadband"),
    "initialise": ("initiali[sz](e|es|ed|ing|ation)", "factory reset"),
    "bundle": ("bundl(e|es|ed|er|ing)", "recording"),
    "black box": ("black ?box(es)?", "recorder"),
    "lapse": ("laps(e|es|ed|ing)", "expire"),
    "have back": ("(have|has|had|having|want|wants|get|gets|got) (it |them |this |that )?back", "restore"),
    "come to": ("(come|comes|came|coming) to (be|hold|a|an|the|this|what|nothing)", "result in"),
    "by itself": ("(by|of) (itself|themselves)", "automatically"),
    "by hand": ("by hand", "manually"),
    "anew": ("anew", "again"),
    "so long": ("so long", "while, until"),
    "in vain": ("in vain", "(rephrase)"),
    "all the same": ("all the same", "anyway"),
    "look over": ("look(s|ed|ing)? (over|again|after|through)", "check, review"),
    "let go": ("let(s|ting)? (\\w+ )?go", "torque off, release"),
    "take away": ("(take|takes|took|taken|taking) away", "torque off, release"),
    "once more": ("once more|once again", "again"),
    "to and fro": ("to and fro", "back and forth, oscillates"),
    "owns": ("owns", "(noun phrase or imperative)"),
    "owe": ("ow(e|es|ed|ing)", "pending"),
    "dawdle": ("dawdl(e|es|ed|ing)", "slow"),
    "grave": ("grave|graver|gravity", "severity"),
}
"""Name: (forms, what to write)."""
WEIGHED: Final = {
    "say": ("say(s|ing)?|said", "report, state"),
    "keep": ("kept|keep(s|ing)?", "store, stored, retained"),
    "stand": ("stand(s|ing)?|stood", "is, appears"),
    "hold": ("hold(s|ing|er|ers)?|held", "has, contains"),
    "look": ("look(s|ed|ing)?", "check, read"),
    "way": ("ways?", "direction"),
    "unit": ("units?", "target"),
    "hand": ("hand(s|ed|ing)?", "worker; pass"),
    "someone": ("someone|anyone", "client, user, operator"),
    "ones": ("ones", "(name the thing)"),
    "sheet": ("sheets?", "record"),
    "wave": ("waves?", "batch"),
    "what is": ("what (is|was|are|were|has|had)", "(rephrase)"),
    "how": ("how (it|they|many|much|long|far|fast|soon|often|well)", "number, duration, distance, rate"),
    "bring": ("bring(s|ing)?|brought", "import, set"),
    "let": ("let(s|ting)?", "allow"),
    "know": ("know(s|ing)?|knew", "(rephrase)"),
    "thing": ("things?|something|anything", "(name it)"),
    "alone": ("alone", "only"),
    "still": ("still", "(often superfluous)"),
    "wait": ("wait(s|ed|ing)? for", "(check the subject)"),
}
"""Words with a proper sense, too: judge each occurrence."""

GENERATED: Final = (
    "schemas/generated/*", "web/src/api/schema.d.ts", "docs/reference/api/*", "docs/reference/command-line.md",
    "docs/reference/fidelity.md", "server/hornbill/client/sync/*", "server/hornbill/client/responses.py",
    "docs/reference/metrics.md", "docs/reference/websocket.md", "THIRD_PARTY.md", "*.lock", "LICENSE", "tools/words.py",
)  # fmt: skip
ALLOWED: Final = (
    ("dead band", "*", r"\bDead band\b", "name of row 0x32 in the specification"),
    ("initialise", "*", r"Initiali[sz]e|initialise_parameters", "name of row 0x10 in the specification"),
    ("unit", "*", r"position[ _]unit|per_unit|\bunits?=|\"unit\"|\.unit\b|tests.unit", "unit of measure"),
    ("let", "web/*", r"^\s*(export )?let \w|for \(let ", "keyword of TypeScript"),
    ("ask", "*", r"\basks? for (confirmation|the servo's name)", "of a program and its user"),
    ("tell", "*", r"\b(told|tells?|telling) \w* ?apart", "idiomatic"),
    ("stand", "*", r"\bstand(s)? alone\b|\bstandalone\b", "idiomatic"),
)  # fmt: skip
"""Word, files, text of the line, reason: quotations that stay."""
_GAP: Final = r"(?:[ \-]+|[ \-]*\n[ \t]*(?:#:?|//|\*|>)?[ \t]*)"


@dataclass(frozen=True)
class Occurrence:
    """One word in one line. Line 0 is the file's name."""

    path: str
    line: int
    word: str
    text: str


def patterns(words: list[str] | None, *, sure: bool) -> dict[str, re.Pattern[str]]:
    """Compiled forms by name. A word that the glossary lacks is searched as it is."""
    known = {**SURE, **({} if sure else WEIGHED)}
    wanted = {word: known.get(word) or WEIGHED.get(word) or (re.escape(word), "") for word in words or known}
    return {word: _compiled(forms) for word, (forms, _) in wanted.items()}


def _compiled(forms: str) -> re.Pattern[str]:
    gapped = forms.replace("\\ ", " ").replace(" ?", "\0").replace(" ", _GAP).replace("\0", " ?")
    return re.compile(rf"(?<![A-Za-z])(?:{gapped})(?![A-Za-z])", re.IGNORECASE)


def split(text: str) -> str:
    """Identifiers as separate words, on the same lines."""
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", text)
    return parted.replace("_", " ")


def files(paths: list[str]) -> list[str]:
    """Tracked and new text files below the paths, without generated ones."""
    command = ["git", "ls-files", "-co", "--exclude-standard", "-z", "--", *(paths or PLACES)]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    inside = tuple(f"{place}/" for place in PLACES if place != ".")
    return sorted(
        {
            path
            for path in found
            if path.endswith(ENDINGS) or path.startswith(("docker/", ".github/"))
            if paths or "/" not in path or path.startswith(inside)
            if (ROOT / path).is_file() and not any(fnmatch(path, made) for made in GENERATED)
        }
    )


def allowed(word: str, path: str, line: str) -> bool:
    """Whether a line quotes the word for a reason given in ALLOWED."""
    return any(word == name and fnmatch(path, where) and re.search(text, line) for name, where, text, _ in ALLOWED)


def search(path: str, wanted: dict[str, re.Pattern[str]], *, names: bool = False) -> Iterator[Occurrence]:
    """Occurrences in one file, in order of line."""
    text = (ROOT / path).read_text(encoding="utf-8", errors="replace")
    lines, parted = text.split("\n"), split(text)
    found: list[Occurrence] = []
    for word, pattern in wanted.items():
        if names and pattern.search(split(path)):
            found.append(Occurrence(path, 0, word, "(name of the file)"))
        for match in pattern.finditer(parted):
            number = parted.count("\n", 0, match.start()) + 1
            if not allowed(word, path, lines[number - 1]):
                found.append(Occurrence(path, number, word, lines[number - 1].strip()))
    yield from sorted(found, key=lambda one: (one.line, one.word))


def folder(path: str, depth: int) -> str:
    """Folder of a file, down to a depth."""
    parts = path.split("/")[:-1]
    return "/".join(parts[:depth]) or "(top)"


def tables(found: list[Occurrence], depth: int) -> Iterator[str]:
    """Occurrences by folder, then by word."""
    folders = Counter(folder(each.path, depth) for each in found)
    width = max((len(name) for name in folders), default=6)
    yield f"{'folder':{width}}  count  most frequent"
    for name in sorted(folders):
        words = Counter(each.word for each in found if folder(each.path, depth) == name)
        often = ", ".join(f"{word} {count}" for word, count in words.most_common(8))
        yield f"{name:{width}}  {folders[name]:5}  {often}"
    yield f"{'total':{width}}  {len(found):5}"
    yield ""
    yield f"{'word':14} count  write"
    known = {**SURE, **WEIGHED}
    for word, count in Counter(each.word for each in found).most_common():
        yield f"{word:14} {count:5}  {known.get(word, ('', ''))[1]}"


def main() -> None:
    """List occurrences and print the tables."""
    arguments = argparse.ArgumentParser(
        prog="python -m tools.words", description="List words that the glossary replaces."
    )
    arguments.add_argument("paths", nargs="*", help="files or folders; default: the whole checkout")
    arguments.add_argument("-w", "--word", action="append", help="only this word of the glossary, or any other text")
    arguments.add_argument("--sure", action="store_true", help="leave out words that also have a proper sense")
    arguments.add_argument("--summary", action="store_true", help="tables only")
    arguments.add_argument("--files", action="store_true", help="search names of files, too")
    arguments.add_argument("--depth", type=int, default=3, help="folders of the table; default: 3 levels")
    given = arguments.parse_args()
    wanted = patterns(given.word, sure=given.sure)
    found = [each for path in files(given.paths) for each in search(path, wanted, names=given.files)]
    try:
        if not given.summary:
            for each in found:
                print(f"{each.path}:{each.line}: [{each.word}] {each.text[:160]}")
            print()
        print("\n".join(tables(found, given.depth)))
    except BrokenPipeError:
        sys.stderr.close()


if __name__ == "__main__":
    main()
