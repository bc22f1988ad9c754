"""Writing, reading and replaying logs and recordings, and the folders they are stored in."""
