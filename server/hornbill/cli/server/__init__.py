"""Commands for the server: starting it, who may use it, its bus, jobs and records."""
