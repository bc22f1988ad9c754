"""Entry point of `python -m hornbill`."""

from hornbill.cli import main

main()
