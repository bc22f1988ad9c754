"""Data models that hornbill returns or publishes, described on their fields."""
