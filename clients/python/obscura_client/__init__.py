# SPDX-License-Identifier: Apache-2.0
"""Python client of the Obscura rendering server, and of running cameras.

    import obscura_client

    with obscura_client.start("demo") as camera:    # a server of this program's own, with a shipped scene
        camera.render().save("demo.png")

`connect()` uses a server that runs already (`obscura serve`), `connect_camera()` a camera (`obscurad`). Needs numpy and
nothing else.
"""
from .camera import Camera, Frame, connect_camera
from .client import Client, connect
from .errors import ConnectionLost, ObscuraError, RequestError
from .picture import Picture
from .server import start

__all__ = ["Camera", "Client", "ConnectionLost", "Frame", "ObscuraError", "Picture", "RequestError", "connect", "connect_camera", "start"]
__version__ = "0.2.0"
