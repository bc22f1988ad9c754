"""Routes of what servos are and report."""
