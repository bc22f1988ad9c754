"""Routes of the server itself: access, audit, jobs, schema, metrics, recorder, simulator."""
