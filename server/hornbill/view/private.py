"""A viser server that only this process can reach, without output and without outgoing connections."""

import os

import rich
import viser


class PrivateServer(viser.ViserServer):
    """viser on the loopback address, on a free port, without its public tunnel."""

    def __init__(self) -> None:
        os.environ.pop("_VISER_PORT_OVERRIDE", None)  # would move the server to a known port
        rich.get_console().quiet = True  # viser announces itself on standard output
        super().__init__(host="127.0.0.1", port=0, label="hornbill", verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Do nothing. viser's method would publish the local server through its vendor's at any client's request."""
        return None

    def key_of(self, client: viser.ClientHandle) -> str:
        """Path of this client's socket without slashes. Empty if it is closed.

        viser does not expose the addresses of its clients, so this reads its private connections (viser 1.1).
        """
        live = self._websock_server._live_connections  # pyright: ignore[reportPrivateUsage]
        request = getattr(live.get(client.client_id), "request", None)
        return "" if request is None else str(request.path).partition("?")[0].strip("/")
