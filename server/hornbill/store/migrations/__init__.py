"""Migrations from an empty database to the current tables, one file each in versions/."""
