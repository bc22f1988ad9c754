"""CanPort made real: the embedded bus, python-can adapters, and the address that chooses one."""
