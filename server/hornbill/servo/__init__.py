"""What a servo is, seen from the host: identity, readings, writes, save, motion, stop."""
