"""Ports of adapters: python-can, raw SocketCAN, serial line, network."""
