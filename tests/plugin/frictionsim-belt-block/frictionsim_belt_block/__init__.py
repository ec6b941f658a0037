"""A plug-in of frictionsim: the kind `belt_block`."""
