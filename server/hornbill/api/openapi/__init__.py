"""The OpenAPI document: what FastAPI does not say of itself."""
