"""A DroneCAN participant on one CanPort: requests, own status, node ID allocation."""
