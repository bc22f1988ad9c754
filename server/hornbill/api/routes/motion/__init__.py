"""Routes of motion, leases and stop."""
