# SPDX-License-Identifier: Apache-2.0
"""A server of this program's own."""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import tempfile
import weakref
from typing import Optional, Union

from .client import Client
from .errors import ConnectionLost


def find_program() -> str:
    """The program `obscura`: of the environment variable OBSCURA, else of the source tree that this package stands in, else of
    PATH. Raises ConnectionLost."""
    built = pathlib.Path(__file__).resolve().parents[3] / "build" / "release" / "tools" / "obscura"
    for program in (os.environ.get("OBSCURA"), str(built) if built.is_file() else None, shutil.which("obscura")):
        if program:
            return program
    raise ConnectionLost("the program obscura is not found: set the environment variable OBSCURA to its path")


def _stop(process: "subprocess.Popen[str]", folder: str) -> str:
    """Ends the server; returns what it complained of."""
    complaints = process.communicate()[1]  # closes its standard input, upon which it ends
    shutil.rmtree(folder, ignore_errors=True)
    return complaints.strip()


def start(scene: Optional[str] = None, *, root: Union[str, "os.PathLike[str]"] = ".", threads: int = 0,
          program: Optional[str] = None, timeout_s: float = 600) -> Client:
    """Starts `obscura serve` and returns its client; the server ends with the client, or with this program.

    scene: a shipped scene, or a file below `root`, to begin with; root: folder below which scenes may name files; threads:
    render threads, 0: one per core. Raises ConnectionLost, RequestError."""
    program = program or find_program()
    folder = tempfile.mkdtemp(prefix="obscura-")  # of this user alone, and so is the socket in it
    command = [program, "serve", "--listen", "none", "--unix", os.path.join(folder, "socket"), "--root", os.fspath(root),
               "--threads", str(threads), "--clients", "1", "--with-input"]
    try:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   start_new_session=True)  # Ctrl-C is for the client
    except OSError as error:
        os.rmdir(folder)
        raise ConnectionLost(f"{program}: {error.strerror}") from None

    assert process.stdout is not None
    line = process.stdout.readline()
    if not line.startswith("listening at "):
        raise ConnectionLost(_stop(process, folder) or f"{program}: ended at its start")
    try:
        client = Client(command[5], timeout_s)
    except BaseException:
        _stop(process, folder)
        raise
    client.on_close = weakref.finalize(client, _stop, process, folder)  # at the latest when this program ends
    if scene is not None:
        try:
            client.load(scene)
        except BaseException:
            client.close()
            raise
    return client
