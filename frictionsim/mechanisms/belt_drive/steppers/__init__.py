"""The integration methods of belts."""
