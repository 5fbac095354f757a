"""What serialised messages say, without deserialising them."""

from __future__ import annotations

import struct


def header_stamp(data: bytes) -> int:
    """Return the stamp [ns] of a message that starts with a header, from its CDR bytes."""
    order = "<" if data[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", data, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
