"""Torque off until the servo acknowledges: stop, and retries after a lost servo or process."""
