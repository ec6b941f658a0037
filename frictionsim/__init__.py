"""Mechanisms in which dry friction decides: exact stick, located breakaway."""

__version__ = "0.1.0"
