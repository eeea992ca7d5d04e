# SPDX-License-Identifier: Apache-2.0
"""Shared memory that the server writes arrays to."""
from __future__ import annotations

import mmap
import os
import struct
from typing import Any, Mapping

import numpy

_SEQUENCE = struct.Struct("<Q")


class SharedMemory:
    """Ring of slots, mapped for reading; `answer`: of the call memory.open. Takes the descriptor over."""

    def __init__(self, descriptor: int, answer: Mapping[str, Any]) -> None:
        self._stride: int = answer["stride"]
        self._head: int = answer["head_bytes"]
        try:
            self._map = mmap.mmap(descriptor, answer["slots"] * self._stride, mmap.MAP_SHARED, mmap.PROT_READ)
        finally:
            os.close(descriptor)

    def body(self, slot: int) -> numpy.ndarray[Any, Any]:
        """Bytes of the arrays of a slot, not copied."""
        return numpy.frombuffer(self._map, numpy.uint8, self._stride - self._head, slot * self._stride + self._head)

    def sequence(self, slot: int) -> int:
        """Another number once the slot has been written again; odd while it is."""
        sequence: int = _SEQUENCE.unpack_from(self._map, slot * self._stride)[0]
        return sequence


class Place:
    """Where the arrays of one answer stand."""

    def __init__(self, memory: SharedMemory, row: Mapping[str, Any]) -> None:
        self._memory = memory
        self._slot: int = row["slot"]
        self._sequence: int = row["sequence"]

    def body(self) -> numpy.ndarray[Any, Any]:
        return self._memory.body(self._slot)

    @property
    def is_whole(self) -> bool:
        """Whether everything read so far was that answer."""
        return self._memory.sequence(self._slot) == self._sequence
