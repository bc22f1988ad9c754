"""Routes of the bus, its nodes and its logs."""
