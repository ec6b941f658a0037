"""Fits: values of free keys for which a scenario agrees best with measured data."""
