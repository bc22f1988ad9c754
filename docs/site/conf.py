"""Sphinx settings for `make docs`: pages, addresses and theme."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

INSIDE = ("README", "CONTRIBUTING", "CHANGELOG", "SECURITY", "THIRD_PARTY")
FOLDERS = ("server", "web", "schemas", "tests", "examples", "docs/site")
MANUAL = "schemas/generated/parameters.md"

project = "hornbill"
html_title = "hornbill documentation"
root_doc = "index"
extensions = ["myst_parser", "sphinx_copybutton", "pages"]
include_patterns = [
    "docs/**.md",
    MANUAL,
    *(f"{name}.md" for name in INSIDE),
    *(f"{name}/README.md" for name in FOLDERS),
]
exclude_patterns = [".*", "**/node_modules", "**/dist", "build"]
myst_heading_anchors = 6

html_theme = "furo"
html_theme_options: dict[str, list[str]] = {"top_of_page_buttons": []}
html_favicon = "../../web/public/mark.svg"
html_static_path = ["static", "../../web/src/style/tokens.css"]
html_css_files = ["tokens.css", "site.css"]
templates_path = ["templates"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
html_domain_indices = False
html_use_index = False
