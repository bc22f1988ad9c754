"""Runs the command line as `python -m hornbill`."""

from hornbill.cli import main

main()
