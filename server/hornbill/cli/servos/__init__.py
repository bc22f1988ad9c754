"""Commands for servos: values, motion, measurements, commissioning, faults."""
