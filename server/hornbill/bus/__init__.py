"""CanPort made real: the embedded bus, python-can adapters, and the address that chooses one."""

import logging

# python-can warns on stderr about drivers that are missing, used or not. What matters is in our own errors.
logging.getLogger("can").addHandler(logging.NullHandler())
