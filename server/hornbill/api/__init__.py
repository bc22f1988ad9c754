"""REST and WebSocket on top of the servo layer, with routes generated from the tables."""

from typing import Final

PREFIX: Final = "/api/v1"
"""Path prefix of the API. Routers are created with it, because `include_router` would build every route twice."""
