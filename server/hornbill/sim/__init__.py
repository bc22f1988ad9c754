"""The simulated servo, as documented. Uses the wire and the tables, never the host."""
