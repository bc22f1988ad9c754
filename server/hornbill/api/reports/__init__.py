"""Job reports as CSV, JSON, JUnit XML and printable HTML."""
