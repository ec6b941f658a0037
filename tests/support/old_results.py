"""What stands for an older result where nobody reads it: it bears the line with our checksum."""

from frictionsim.io.checksum import checksum_trailer
from frictionsim.results import HDF5_SIGNATURE


def old_result(content: bytes = b"the result of yesterday") -> bytes:
    """Return the bytes of a file that is ours by its beginning and its end."""
    image = HDF5_SIGNATURE + content
    return image + checksum_trailer(image)
