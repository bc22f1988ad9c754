"""Write the generated files (`make generate`) and print the name of each file that changed."""

import sys

from . import files

for file, text in files():
    file.parent.mkdir(parents=True, exist_ok=True)
    if not file.is_file() or file.read_text(encoding="utf-8") != text:
        file.write_text(text, encoding="utf-8")
        sys.stdout.write(f"changed: {file.name}\n")
