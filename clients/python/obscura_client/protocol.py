# SPDX-License-Identifier: Apache-2.0
"""Native protocol without sockets: frames of 24 bytes, MessagePack heads, and arrays with their codecs."""
from __future__ import annotations

import hmac
import importlib
import os
import pathlib
import struct
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Union

import numpy

from . import messagepack
from .errors import ObscuraError

Arrays = Dict[str, numpy.ndarray[Any, Any]]
Token = Union[bytes, str, "os.PathLike[str]"]

FRAME_BYTES = 24
MAX_DESCRIPTORS = 4  # of a message
REQUEST, ANSWER, EVENT, ERROR = 1, 2, 3, 4
_FRAME = struct.Struct("<4sBBHIIQ")
_MAGIC, _VERSION = b"OBSC", 1
_MODULES = {"shuffle-lz4": ("lz4.block", "python3-lz4"), "shuffle-zstd": ("zstandard", "python3-zstandard")}


class Frame(NamedTuple):
    """First bytes of a message."""

    kind: int
    number: int
    head_bytes: int
    body_bytes: int


def request(number: int, call: str, fields: Dict[str, Any]) -> bytes:
    """A request as it is sent."""
    head = messagepack.pack({"call": call, **fields})
    return _FRAME.pack(_MAGIC, _VERSION, REQUEST, 0, number, len(head), 0) + head


def frame(data: messagepack.Buffer) -> Frame:
    """Raises ValueError for what is no frame of this protocol."""
    magic, version, kind, _flags, number, head_bytes, body_bytes = _FRAME.unpack(data)
    if magic != _MAGIC or version != _VERSION:
        raise ValueError("the server does not speak this protocol")
    return Frame(kind, number, head_bytes, body_bytes)


def hello_fields() -> Dict[str, Any]:
    """Fields of hello, without the proof of a token."""
    from . import __version__

    return {"protocol_min": 1, "protocol_max": 1, "client": f"obscura_client {__version__}"}


def proof(token: Token, challenge: str) -> str:
    """The field `proof` of hello. Raises ObscuraError for what is no token."""
    try:
        secret = token if isinstance(token, bytes) else pathlib.Path(token).read_bytes()
    except OSError as error:
        raise ObscuraError(f"{error.filename}: {error.strerror}") from None
    if len(secret) != 32:
        raise ObscuraError(f"a token of {len(secret)} bytes, allowed 32")
    return hmac.new(secret, bytes.fromhex(challenge), "sha256").hexdigest()


def codecs() -> List[str]:
    """Codecs that this Python can read."""
    return ["none"] + [name for name, (module, _) in _MODULES.items() if _found(module)]


def _found(module: str) -> bool:
    try:
        importlib.import_module(module)
    except ImportError:
        return False
    return True


def check_codec(codec: str) -> None:
    """Raises ObscuraError unless arrays of that codec can be read here."""
    if codec != "none" and codec not in _MODULES:
        raise ObscuraError(f"codec {codec!r}: allowed none, {', '.join(_MODULES)}")
    if codec not in codecs():
        module, package = _MODULES[codec]
        raise ObscuraError(f"codec {codec!r} needs Python's {module.split('.')[0]} (Debian package {package})")


def codec_for(wanted: Optional[str], is_local: bool, server: Mapping[str, Any]) -> str:
    """The codec to ask for: the one that is wanted, else none of a server on this machine, else one that both sides have."""
    if wanted is not None:
        check_codec(wanted)
        return wanted
    known = [] if is_local else server.get("codecs", [])
    return next((name for name in codecs()[1:] if name in known), "none")


def arrays(head: Dict[str, Any], body: numpy.ndarray[Any, Any]) -> Arrays:
    """Takes the arrays out of the head. Those without a codec are views of the body."""
    return {row["name"]: _array(row, body[row["offset"]:row["offset"] + row["bytes"]]) for row in head.pop("arrays", ())}


def _array(row: Dict[str, Any], data: numpy.ndarray[Any, Any]) -> numpy.ndarray[Any, Any]:
    dtype, shape = numpy.dtype(row["dtype"]), tuple(row["shape"])
    if row["codec"] == "none":
        return data.view(dtype).reshape(shape)
    check_codec(row["codec"])
    module = importlib.import_module(_MODULES[row["codec"]][0])
    count = int(numpy.prod(shape, dtype=numpy.int64))
    if row["codec"] == "shuffle-lz4":
        sorted_bytes = module.decompress(data, uncompressed_size=count * dtype.itemsize)
    else:
        sorted_bytes = module.ZstdDecompressor().decompress(data, max_output_size=count * dtype.itemsize)
    planes = numpy.frombuffer(sorted_bytes, numpy.uint8).reshape(dtype.itemsize, count)
    values = numpy.zeros(count, f"<u{dtype.itemsize}")
    for place, plane in enumerate(planes):  # faster than a transposed copy of bytes
        values |= plane.astype(values.dtype) << values.dtype.type(8 * place)
    return values.view(dtype).reshape(shape)
