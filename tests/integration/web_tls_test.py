#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura-web over TLS: certificate, versions, what plain HTTP is told, clients that stop in the middle, files that are wrong.

Usage: web_tls_test.py OBSCURA-WEB
Exit status 1 if a check failed, 77 without the program openssl, which makes the certificates.
"""
import pathlib
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import warnings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import web_server  # noqa: E402

web = sys.argv[1]
PATIENCE_S = web_server.PATIENCE_S
failures = []
if not shutil.which("openssl"):
    print("skipped: the program openssl is not installed (Debian package openssl)")
    sys.exit(77)


def check(what, good, detail=""):
    if not good:
        failures.append(what)
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)


def make(folder, name):
    """Certificate of localhost and its key."""
    files = [str(folder / f"{name}.{kind}") for kind in ("crt", "key")]
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj",
                    "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-out", files[0], "-keyout", files[1]], capture_output=True, check=True)
    return files


def handshake(port, trust, version):
    """Version that was agreed on; "": none."""
    context = ssl.create_default_context(cafile=trust)
    context.set_ciphers("ALL:@SECLEVEL=0")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        context.minimum_version = context.maximum_version = version
    with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as plain:
        try:
            with context.wrap_socket(plain, server_hostname="localhost") as secure:
                return secure.version()
        except (ssl.SSLError, ConnectionError):
            return ""


with tempfile.TemporaryDirectory(prefix="obscura-web-tls-") as temporary:
    folder = pathlib.Path(temporary)
    certificate, key = make(folder, "one")
    other, other_key = make(folder, "two")
    server = web_server.Web(web, "--socket", folder / "none", "--tls-certificate", certificate, "--tls-key", key, trust=certificate)
    check("the link is of HTTPS", server.link.startswith(f"https://127.0.0.1:{server.port}/#token="), server.link)
    check("it answers a client that trusts its certificate", server.ask("/livez").text == "ok\n" and server.ask("/readyz").status == 503)
    try:
        ssl.create_default_context(cafile=other).wrap_socket(socket.create_connection(("127.0.0.1", server.port)), server_hostname="localhost")
        check("and not one that does not", False)
    except ssl.SSLCertVerificationError:
        check("and not one that does not", True)
    for version, wanted in (ssl.TLSVersion.TLSv1_1, ""), (ssl.TLSVersion.TLSv1_2, "TLSv1.2"), (ssl.TLSVersion.TLSv1_3, "TLSv1.3"):
        check(f"{version.name}: {wanted or 'refused'}", handshake(server.port, certificate, version) == wanted)
    plain = server.raw(f"GET / HTTP/1.1\r\nHost: localhost:{server.port}\r\n\r\n".encode())
    check("plain HTTP is told in one line", plain.startswith(b"HTTP/1.1 400 ") and plain.split(b"\r\n\r\n")[1].count(b"\n") == 1 and b"https://" in plain, plain)
    connection = server.connection()
    for _ in range(3):
        connection.request("GET", "/page.js")
        text = connection.getresponse().read()
    check("a connection answers again and again, whole files", len(text) > 1000 and text == server.ask("/page.js").content)
    connection.close()
    check("the page's own origin has https", server.ask("/api/v1/state", Origin=f"https://localhost:{server.port}").status == 200 and
          server.ask("/api/v1/state", Origin=f"http://localhost:{server.port}").status == 403)
    check("what is too long is refused", server.ask("/api/v1/state", X="y" * 20000).status == 431)
    context = ssl.create_default_context(cafile=certificate)
    with context.wrap_socket(socket.create_connection(("127.0.0.1", server.port), PATIENCE_S), server_hostname="localhost") as stream:
        stream.sendall(f"GET /api/v1/events HTTP/1.1\r\nHost: localhost:{server.port}\r\nAuthorization: Bearer {server.token}\r\n\r\n".encode())
        text = b""
        while b"\r\n\r\n" not in text:
            text += stream.recv(4096)
        check("the log comes as a stream", b"text/event-stream" in text, text)
    silent = [socket.create_connection(("127.0.0.1", server.port), PATIENCE_S) for _ in range(8)]
    for client, start in zip(silent, (b"", b"\x16", b"\x16\x03\x01", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"\0" * 4, b"\x16\x03\x01\x40\x00" + b"\xff" * 300, b"G",
                                      b"\x80\x2e\x01\0\x02")):
        client.sendall(start)
    check("clients that stop in the middle hold up no other", server.ask("/livez").status == 200)
    check("and lose their connections", all(b"".join(iter(lambda client=client: client.recv(4096), b"")) is not None for client in silent))
    check("it ends well", server.end() == 0)

    server = web_server.Web(web, "--socket", folder / "none", "--tls-certificate", certificate, "--tls-key", key, "--listen", "0.0.0.0:0", trust=certificate)
    check("with TLS it may listen at other interfaces", server.ask("/livez").status == 200 and server.end() == 0)
    (folder / "empty").write_text("")
    for arguments, status in ((certificate, other_key), 78), ((folder / "none", key), 78), ((certificate, folder / "empty"), 78), ((certificate, ""), 64):
        refused = subprocess.run([web, "--listen", "127.0.0.1:0", "--tls-certificate", arguments[0], *(["--tls-key", arguments[1]] if arguments[1] else [])],
                                 capture_output=True, text=True, timeout=PATIENCE_S)
        check(f"{pathlib.Path(arguments[0]).name} and {pathlib.Path(arguments[1]).name or 'no key'} are refused in one line: {refused.stderr.strip()}",
              refused.returncode == status and refused.stderr.count("\n") == 1, refused)
sys.exit(1 if failures else 0)
