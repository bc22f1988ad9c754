"""Facts that hornbill responds with or publishes: each once, described on its fields."""
