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
