"""What servos and the bus do over time: polling, telemetry, faults, bus monitor, node IDs."""
