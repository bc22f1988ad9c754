"""Routes of servos: state, inventory, faults and telemetry."""
