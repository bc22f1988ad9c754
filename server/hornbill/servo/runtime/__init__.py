"""Event hub, jobs, audit and time base: what every chapter uses."""
