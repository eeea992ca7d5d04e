# SPDX-License-Identifier: Apache-2.0
"""Decompression of zstd frames in tests."""
import ctypes


def zstd(data):
    """The bytes that a zstd frame of at most 64 MiB holds, by the library itself."""
    library = ctypes.CDLL("libzstd.so.1")
    library.ZSTD_decompress.restype = ctypes.c_size_t
    out = ctypes.create_string_buffer(1 << 26)
    size = library.ZSTD_decompress(out, ctypes.c_size_t(len(out)), data, ctypes.c_size_t(len(data)))
    return out.raw[:size]
