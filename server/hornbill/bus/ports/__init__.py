"""Ports on adapters: python-can, raw SocketCAN, serial line, network."""
