"""Access control: origin, tokens, sessions, roles."""
