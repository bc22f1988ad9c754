"""REST and WebSocket over the servo layer, with routes made from the tables."""
