# SPDX-License-Identifier: Apache-2.0
"""A running obscura-web for tests: requests with and without tokens, raw bytes, and what the process needs."""
import http.client
import json
import os
import pathlib
import socket
import ssl
import subprocess

from children import Child

PATIENCE_S = 60  # a busy machine, a sanitizer


class Web:
    """A running obscura-web. `trust`: a certificate; then it is asked over TLS. `process`: options of subprocess.Popen."""

    def __init__(self, program, *arguments, trust=None, **process):
        self.process = Child([program, "--listen", "127.0.0.1:0", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **process)
        self.link = self.process.stdout.readline().strip()
        if not self.link:
            raise RuntimeError(self.process.communicate()[1])
        self.port = int(self.link.split("//")[1].split("/")[0].split(":")[1])
        self.token = self.link.partition("token=")[2]
        self.context = ssl.create_default_context(cafile=trust) if trust else None

    def connection(self):
        if self.context:
            return http.client.HTTPSConnection("localhost", self.port, timeout=PATIENCE_S, context=self.context)
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)

    def ask(self, path, method="GET", token=None, body=None, **headers):
        """The answer, with `content` (bytes; none of an endless answer) and `text`. `body`: what is sent as JSON, or bytes as they are."""
        connection = self.connection()
        token = self.token if token is None else token
        headers = {key.replace("_", "-"): value for key, value in headers.items()}
        if token:
            headers["Authorization"] = f"Bearer {token}"
        if body is not None:
            headers.setdefault("Content-Type", "application/json")
        connection.request(method, path, body if body is None or isinstance(body, bytes) else json.dumps(body).encode(), headers)
        answer = connection.getresponse()
        endless = (answer.headers["Content-Type"] or "").startswith("multipart/")
        answer.content = b"" if endless else answer.read()
        answer.text = answer.content.decode("utf-8", "replace")
        connection.close()
        return answer

    def raw(self, data, until_closed=True):
        """What comes back for bytes, until the server ends the connection."""
        with socket.create_connection(("127.0.0.1", self.port), PATIENCE_S) as client:
            try:
                client.sendall(data)
                answer = b""
                while part := client.recv(65536):
                    answer += part
                    if not until_closed:
                        break
            except OSError:
                pass
            return answer

    def resident_mib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1024

    def processor_s(self):
        user, system = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")

    def end(self):
        """Its exit status; `log` has what it wrote to standard error."""
        self.process.terminate()
        self.log = self.process.communicate(timeout=PATIENCE_S)[1]
        return self.process.returncode
