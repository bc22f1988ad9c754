"""Each reason why a row has no effect has a Japanese sentence on the page, by the server's very words."""

import re
from pathlib import Path

from hornbill.schema.catalog import Catalog
from hornbill.servo.reading import CIRCUMSTANCES

WHY = Path(__file__).parents[2] / "web/src/text/ja/why.ts"


def reasons() -> set[str]:
    """What may stand behind "No effect now: ", with every kind of command a rule asks for."""
    found = {one.why for one in CIRCUMSTANCES} | {"it acts at the next start, when it has been saved"}
    for rule in Catalog.load().effects:
        kinds = {kind for condition in rule.when for kind in condition.last_command} or {"none"}
        found |= {why.replace("{last_command}", kind) for why in (rule.why, rule.why_absent) if why for kind in kinds}
    return found


def test_each_reason_has_its_sentence_and_no_sentence_is_left_over() -> None:
    known = set(re.findall(r'^  "(.+?)":', WHY.read_text(encoding="utf-8"), re.MULTILINE))
    assert known == reasons()
