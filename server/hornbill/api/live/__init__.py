"""WebSocket and event stream."""
