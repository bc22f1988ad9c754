"""Settings, composition and serving of the server process."""
