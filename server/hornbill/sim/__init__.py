"""The servo itself, as its document says it behaves. Sees the wire and the tables, never the host."""
