"""Who may send which request: origin, tokens, sessions, roles."""
