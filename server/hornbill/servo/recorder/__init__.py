"""The recorder: the last ten minutes of the bus, recordings of it, and their replay."""
