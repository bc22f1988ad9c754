"""Routes that read, change, save and compare parameters."""
