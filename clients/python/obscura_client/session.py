# SPDX-License-Identifier: Apache-2.0
"""Connection to a server of the native protocol, whatever calls it has."""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional, TypeVar

from .calls import Calls
from .connection import Connection
from .protocol import Token

Self = TypeVar("Self", bound="Session")


class Session:
    """A connection. Use it in a `with` statement, or call close(). Waits at most `timeout_s` for news from the server. Not for
    several threads at once. `calls` has each call, with types."""

    def __init__(self, address: str, timeout_s: float = 600, token: Optional[Token] = None) -> None:
        self.on_close: Optional[Callable[[], object]] = None  # called once, after the connection has ended
        self._connection = Connection(address, timeout_s)
        self.calls = Calls(self._connection.request)
        try:
            self.server: Dict[str, Any] = self._connection.greet(token)
        except BaseException:
            self._connection.close()
            raise

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        state = self._connection.address if self._connection.is_open else "closed"
        return f"<obscura_client.{type(self).__name__} {state}, server {self.server['version']}>"

    def close(self) -> None:
        """Ends the connection, and what the server keeps for it."""
        self._connection.close()
        on_close, self.on_close = self.on_close, None
        if on_close is not None:
            on_close()

    def take_descriptors(self) -> List[int]:
        """Files that a server of this machine has handed over with the last answer; the caller closes them."""
        return self._connection.take_descriptors()

    def call(self, name: str, /, **fields: Any) -> Dict[str, Any]:
        """Any call of the server by its name (see describe()); fields that are None are left out."""
        return self._connection.request(name, {key: value for key, value in fields.items() if value is not None})[0]

    def describe(self) -> Dict[str, Any]:
        """The table of calls (`calls`); of a rendering server the tables and keys of scenes (`sections`), too."""
        return self.call("describe")

    def status(self) -> Dict[str, Any]:
        """What the server does for this connection."""
        return self.call("status")
