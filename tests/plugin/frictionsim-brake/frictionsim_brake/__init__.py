"""A block brake on a flywheel, as a kind of mechanism for frictionsim."""
