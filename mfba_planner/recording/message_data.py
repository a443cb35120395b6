# SPDX-License-Identifier: Apache-2.0
"""The CDR bytes of a stored message: decompressed if needed, checked by their first bytes.

rosbag2 compresses single messages (`--compression-mode message`) and says so in metadata.yaml
only. CDR starts with two bytes that name its representation, the first of them 0, so neither
zstd's first bytes nor any text passes for CDR.
"""

from __future__ import annotations

import zstandard

from .open_storage import ZSTD_MAGIC

_REPRESENTATIONS = 12  # of CDR, PL_CDR, CDR2, D_CDR2, PL_CDR2 in both byte orders: 0 to 11
_HEADER_BYTES = 4


def cdr_bytes(data: bytes) -> bytes | None:
    """The CDR of a message; None if it is neither CDR nor compressed CDR."""
    if data.startswith(ZSTD_MAGIC):
        try:
            data = zstandard.ZstdDecompressor().decompressobj().decompress(data)
        except zstandard.ZstdError:
            return None
    is_cdr = len(data) >= _HEADER_BYTES and data[0] == 0 and data[1] < _REPRESENTATIONS
    return data if is_cdr else None
