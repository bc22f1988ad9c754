"""Commands under a lease: angle, speed, torque, streams, holds, and identify."""
