"""The embedded bus of demo, simulator and tests."""
