"""Configuration of servos: plan, apply, verify, save and restore."""
