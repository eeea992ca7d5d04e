# SPDX-License-Identifier: Apache-2.0
"""What goes wrong between client and server."""
from __future__ import annotations

from typing import Any, Dict


class ObscuraError(Exception):
    """Base of all errors of this package."""


class ConnectionLost(ObscuraError):
    """The server is gone, cannot be reached, does not answer in time or does not speak the protocol."""


class RequestError(ObscuraError):
    """The server refused a request. The connection lives on.

    code: word such as "bad-argument", "bad-scene", "cancelled"; field: what of the request or scene is wrong; allowed: its
    values; hint: what to try. Fields that the server did not fill are empty.
    """

    def __init__(self, head: Dict[str, Any]) -> None:
        self.code = str(head.get("code", ""))
        self.message = str(head.get("message", ""))
        self.field = str(head.get("field", ""))
        self.allowed = str(head.get("allowed", ""))
        self.hint = str(head.get("hint", ""))
        super().__init__(f"{self.message} ({self.hint})" if self.hint else self.message)
