"""Bus doctor: diagnosis from received frames and counters. Sends nothing."""
