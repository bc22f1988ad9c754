"""Files for Prometheus and Grafana: alert rules and dashboard for the metrics of `metrics.py`."""

from pathlib import Path
from typing import Final

from starlette.responses import FileResponse

from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role

routes = Routes("server")

FILES: Final = Path(__file__).parents[2] / "monitoring"
ALERTS: Final = FILES / "alerts.yaml"
DASHBOARD: Final = FILES / "dashboard.json"


@routes.get("/monitoring/alerts.yaml", Role.VIEW, response_class=FileResponse,
            responses={200: {"content": {"application/yaml": {}}}})  # fmt: skip
async def get_alert_rules() -> FileResponse:
    """Get the alert rules for Prometheus. Add the file to its `rule_files`."""
    return FileResponse(ALERTS, media_type="application/yaml")


@routes.get("/monitoring/dashboard.json", Role.VIEW, response_class=FileResponse,
            responses={200: {"content": {"application/json": {}}}})  # fmt: skip
async def get_dashboard() -> FileResponse:
    """Get the dashboard for Grafana. Import the file there."""
    return FileResponse(DASHBOARD, media_type="application/json")
