"""Commands for bench files: apply and export."""
