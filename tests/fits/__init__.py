"""Tests of fits of free keys to measured data."""
