"""Event hub, jobs, leases, audit and time base, shared by the servo layer."""
