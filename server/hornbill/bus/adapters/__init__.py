"""What a bus can be opened on: interfaces of the kernel, serial ports, and their troubles."""
