"""OpenAPI document: additions to the one FastAPI generates."""
