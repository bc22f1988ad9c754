"""REST and WebSocket over the servo layer, with routes made from the tables."""

from typing import Final

PREFIX: Final = "/api/v1"
"""Where it is. Routers are made with it and their routes taken as they are: `include_router` would build each again."""
