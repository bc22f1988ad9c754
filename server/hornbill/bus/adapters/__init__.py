"""Detection and diagnosis of adapters: kernel interfaces and serial ports."""
