"""Persistent state in one database: node IDs, inventory, snapshots, profiles, jobs, audit and more."""
