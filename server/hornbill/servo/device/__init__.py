"""What is known of each servo: identity, registers, ROM, and how it is read and written."""
