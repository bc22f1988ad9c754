"""Torque off until the servo acknowledges: Stop, and retries across a lost bus or a server restart."""
