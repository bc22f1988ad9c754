"""DroneCAN as bytes: frames, transfers, data types. No clock, no I/O; input from the bus never raises."""
