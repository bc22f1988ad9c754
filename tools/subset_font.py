"""Subset of Inter for the page: Latin, symbols of measured values, weights 400 to 700.

    npm pack inter-ui@4.1.1 && tar xf inter-ui-4.1.1.tgz
    python -m tools.subset_font package/variable/InterVariable.woff2

Writes `web/src/style/inter.woff2`. Inter is under the SIL Open Font License 1.1 (THIRD_PARTY.md).
"""

import sys
from io import BytesIO
from pathlib import Path
from typing import cast

from fontTools import subset
from fontTools.ttLib import TTFont
from fontTools.varLib import instancer

TARGET = Path(__file__).parent.parent / "web" / "src" / "style" / "inter.woff2"
# Characters beyond Latin-1 used in English texts and numbers of the page; U+202F separates a number and its unit.
SIGNS = "−–—‘’“”…•′″←↑→↓↔⇧ΔΩσ≈≠≤≥√\u2009\u202f"
UNICODES = [*range(0x20, 0x7F), *range(0xA0, 0x100), *map(ord, SIGNS)]
FEATURES = ["kern", "mark", "mkmk", "ccmp", "locl", "calt", "tnum"]


def main(source: str) -> None:
    font = TTFont(source)
    # In serial numbers, a hyphen as wide as a digit looks like a minus sign.
    without_wide_hyphen(font)
    subsetter = subset.Subsetter(subset.Options(layout_features=FEATURES, notdef_outline=True))
    subsetter.populate(unicodes=UNICODES)
    subsetter.subset(font)
    # The instancer needs a font loaded from a file.
    file = BytesIO()
    font.save(file)
    made = cast(TTFont, instancer.instantiateVariableFont(TTFont(file), {"opsz": 14, "wght": (400, 700)}))
    made.flavor = "woff2"
    made.save(TARGET)
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1000:.1f} kB")


def without_wide_hyphen(font: TTFont) -> None:
    """Remove the hyphen from the feature for tabular figures."""
    table = font["GSUB"].table
    lookups = {
        index
        for record in table.FeatureList.FeatureRecord
        if record.FeatureTag == "tnum"
        for index in record.Feature.LookupListIndex
    }
    for index in lookups:
        for part in table.LookupList.Lookup[index].SubTable:
            mapping = getattr(getattr(part, "ExtSubTable", part), "mapping", {})
            mapping.pop("hyphen", None)


if __name__ == "__main__":
    main(sys.argv[1])
