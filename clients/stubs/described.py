# SPDX-License-Identifier: Apache-2.0
"""What a rendering server and a camera's daemon tell of their calls."""
from __future__ import annotations

import contextlib
import pathlib
import subprocess
import tempfile
from typing import Any, Dict, Iterator, List

import obscura_client

_CONFIGURATION = """
[scene]
file = "demo"
[gige]
enabled = false
[monitor]
socket = "off"
[control]
unix_socket = "{folder}/calls"
"""


def calls_of_server(obscura: str) -> List[Dict[str, Any]]:
    """Calls of `obscura serve`, as describe gives them."""
    with obscura_client.start(program=obscura) as camera:
        return camera.describe()["calls"]


@contextlib.contextmanager
def running_daemon(obscurad: str) -> Iterator[str]:
    """A daemon that takes calls; gives the path of its socket."""
    with tempfile.TemporaryDirectory(prefix="obscura-calls-") as folder:
        config = pathlib.Path(folder) / "obscurad.toml"
        config.write_text(_CONFIGURATION.format(folder=folder))
        daemon = subprocess.Popen([obscurad, "--config", config], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        try:
            assert daemon.stdout is not None
            daemon.stdout.readline()  # ready
            yield f"{folder}/calls"
        finally:
            daemon.terminate()
            daemon.communicate()


def calls_of_daemon(obscurad: str) -> List[Dict[str, Any]]:
    """Calls of `obscurad`, as describe gives them; those that every connection has are among them."""
    with running_daemon(obscurad) as address, obscura_client.connect_camera(address) as camera:
        return camera.describe()["calls"]
