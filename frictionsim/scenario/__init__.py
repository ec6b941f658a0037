"""Scenarios: their tables, validation and messages, signals, overrides and templates."""
