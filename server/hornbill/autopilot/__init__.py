"""Parameter files of ArduPilot and PX4 for servos on DroneCAN."""
