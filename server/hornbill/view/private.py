"""Starts a viser server that only this process can reach, that prints nothing and that has no way out."""

import os

import rich
import viser


class PrivateServer(viser.ViserServer):
    """viser on the loopback address, on a port the system chooses, without its public tunnel."""

    def __init__(self) -> None:
        os.environ.pop("_VISER_PORT_OVERRIDE", None)  # would move the server to a known port
        rich.get_console().quiet = True  # viser announces itself on standard output
        super().__init__(host="127.0.0.1", port=0, label="hornbill", verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Does nothing. viser's own would publish the local server through its vendor's, on any client's word."""
        return None

    def key_of(self, client: viser.ClientHandle) -> str:
        """The path this client's socket was opened at, without slashes; empty when it has gone.

        viser tells nobody its clients' addresses, so this looks where it keeps its connections (viser 1.1).
        """
        live = self._websock_server._live_connections  # pyright: ignore[reportPrivateUsage]
        request = getattr(live.get(client.client_id), "request", None)
        return "" if request is None else str(request.path).partition("?")[0].strip("/")
