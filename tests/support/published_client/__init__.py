# SPDX-License-Identifier: Apache-2.0
"""Stand-in for the published client, made from a table of its commands."""
from .client import PublishedClient, TABLE

__all__ = ["PublishedClient", "TABLE"]
