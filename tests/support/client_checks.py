# SPDX-License-Identifier: Apache-2.0
"""Checks of the tests of the rendering server through its Python client: a line each; failures are counted.

The tests are called with OBSCURA SOURCE-DIRECTORY, and are skipped without numpy.
"""
import os
import pathlib
import sys
import time

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, source = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
sys.path.insert(0, str(source / "clients" / "python"))
os.environ["OBSCURA"] = obscura
import obscura_client  # noqa: E402
from checks import check, failures  # noqa: E402

PATIENCE_S = 120  # a busy machine, a sanitizer


def check_near(what, got, wanted, limit):
    check(what, abs(got - wanted) <= limit, f"{got!r}, wanted {wanted!r} within {limit}")


def check_refused(what, code, message, call):
    """`call` raises a RequestError of one line with that code and text. Returns it."""
    try:
        call()
    except obscura_client.RequestError as error:
        check(what, error.code == code and message in error.message and "\n" not in error.message,
              (error.code, error.message))
        return error
    check(what, False, "was not refused")
    return obscura_client.RequestError({})


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.05)
    return False


def end():
    """Exit status of the test."""
    print(f"{len(failures)} checks failed")
    return 1 if failures else 0
