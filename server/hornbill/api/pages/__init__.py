"""The page and the documentation, served as files."""
