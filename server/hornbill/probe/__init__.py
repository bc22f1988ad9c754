"""`hornbill probe`: what only a real servo can tell, asked of one and written into a report.

`asking` does things through a running server while it records the bus; `evidence` and `judging` take every answer
from that recording alone; `report` writes them down. docs/explanation/hardware.md is the list of questions.
"""
