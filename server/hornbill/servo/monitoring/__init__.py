"""Monitoring of servos and bus: polling, telemetry, faults, bus monitor, node IDs."""
