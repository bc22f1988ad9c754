"""Configuration that can be trusted: plan, apply, verify, save, prove, undo, for one servo or many."""
