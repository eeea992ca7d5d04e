# SPDX-License-Identifier: Apache-2.0
"""A server of this program's own."""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
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


def start(scene: Optional[str] = None, *, root: Union[str, "os.PathLike[str]"] = ".", threads: int = 0,
          program: Optional[str] = None, timeout_s: float = 600) -> Client:
    """Starts `obscura serve` and returns its client; the server ends with the client, or with this program.

    scene: a shipped scene, or a file below `root`, to begin with; root: folder below which scenes may name files; threads:
    render threads, 0: one per core. Raises ConnectionLost, RequestError."""
    command = [program or find_program(), "serve", "--listen", "127.0.0.1:0", "--root", os.fspath(root), "--threads",
               str(threads), "--clients", "1", "--with-input"]
    try:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   start_new_session=True)  # Ctrl-C is for the client
    except OSError as error:
        raise ConnectionLost(f"{command[0]}: {error.strerror}") from None

    def stop() -> None:
        process.communicate()  # closes its standard input, upon which it ends

    assert process.stdout is not None
    line = process.stdout.readline()
    if not line.startswith("listening at "):
        _, why = process.communicate()
        raise ConnectionLost(why.strip() or f"{command[0]}: ended at its start")
    try:
        client = Client(line.split()[-1], timeout_s, stop)
    except BaseException:
        stop()
        raise
    if scene is not None:
        try:
            client.load(scene)
        except BaseException:
            client.close()
            raise
    return client
