"""Implementations of CanPort: the embedded bus, python-can adapters, and opening by address."""

import logging

# python-can warns on stderr about all missing drivers. Our own errors report those that matter.
logging.getLogger("can").addHandler(logging.NullHandler())
