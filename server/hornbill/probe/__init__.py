"""`hornbill probe`: tests of a real servo for questions the document leaves open, with a report.

`steps` uses a running server while it logs the bus; `evidence` and `evaluation` derive every answer from that log
alone; `report` formats them. docs/explanation/hardware.md is the list of questions.
"""
