"""Tests of one running server on a kernel's CAN. A package to pytest, so that the server ends with the last of them."""
