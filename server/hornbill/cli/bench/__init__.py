"""Commands for a bench file: apply and export."""
