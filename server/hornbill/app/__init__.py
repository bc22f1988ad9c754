"""Settings, composition and serving: what the command line starts."""
