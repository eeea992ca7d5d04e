#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A test bench talks to obscura-instrument by SCPI: settings and triggers reach the camera of a daemon, and no client
that follows no rule disturbs another.

Usage: scpi_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD OBSCURA-INSTRUMENT
Exit status 1 if a check failed, 77 without numpy.
"""
import os
import pathlib
import random
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import textwrap
import time
import urllib.request
import xml.etree.ElementTree as ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from client_checks import PATIENCE_S, check, end, obscura_client, source, wait_for  # noqa: E402
from own_address import own_address  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad, program = (os.path.abspath(argument) for argument in sys.argv[3:5])


class Bench:
    """A connection, as PyVISA makes it for TCPIP::HOST::PORT::SOCKET."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        self.file = self.socket.makefile("rb")

    def write(self, line):
        self.socket.sendall(line.encode() + b"\n")

    def ask(self, line):
        self.write(line)
        return self.file.readline().decode().rstrip("\n")

    def error(self):
        return int(self.ask("SYST:ERR?").partition(",")[0])


class Instrument:
    def __init__(self, *arguments, host="127.0.0.1", stderr=None):
        self.process = Child([program, "--scpi", f"{host}:0", "--lxi", f"{host}:0", *arguments], stdout=subprocess.PIPE, stderr=stderr, text=True)
        ports = [self.process.stdout.readline().split() for _ in range(2 + ("--scpi-view" in arguments))]
        self.port, self.lxi = (int(dict(ports)[name].rpartition(":")[2]) for name in ("scpi", "lxi"))

    def resident_kib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0])

    def end(self):
        self.process.terminate()
        self.process.stdout.close()
        return self.process.wait(PATIENCE_S)


def conversation(bench, other, calls):
    check("it says what it is", bench.ask("*IDN?").startswith("Obscura,obscura-instrument,0,"))
    check("a new connection has no errors", other.error() == 0 and other.ask("*ESR?") == "128")
    check("the camera acquires", bench.ask("ACQ?;:SYST:CAM:COUN?") == "1;1")
    check("a setting is one for all clients", bench.ask("EXP 2.5 MS;EXP?") == "0.0025" and other.ask('FEAT? "ExposureTime"') == "2500")
    limits = bench.ask('FEAT:LIM? "ExposureTime"')
    check("limits are those of the camera", limits == '"1 to 3.6e9 us"' and bench.ask("EXP? MIN;EXP? MAX") == "1e-06;3600", limits)
    bench.write("EXP 4000")
    error = bench.ask("SYST:ERR?")
    check("a value out of range has the daemon's words", error.startswith('-222,"Data out of range;camera.set: ExposureTime: ') and
          "allowed 1 to 3.6e9 us" in error, error)
    names = bench.ask("FEAT:CAT?").split(",")
    values = {name: bench.ask(f"FEAT? {name}") for name in names}
    check("every feature is there", len(names) > 20 and '"Gain"' in names and all(values.values()), values)
    for name, value in values.items():
        if name not in ('"Width"', '"Height"'):
            bench.write(f"FEAT {name},{value}")
    with obscura_client.connect_camera(calls, timeout_s=PATIENCE_S) as camera:
        told = {f'"{name}"': value for name, value in camera.get().items()}
    check("as the daemon's own calls tell it", {name: value.strip('"') for name, value in values.items()} ==
          {name: f"{value:g}" if isinstance(value, (int, float)) else value for name, value in told.items()}, (values, told))
    check("and takes what it told", bench.error() == 0 and {name: bench.ask(f"FEAT? {name}") for name in names} == values)
    bench.write("IMAG:WIDT 32")
    check("the width is locked while the camera acquires", bench.error() == -221)
    bench.write("*TRG")
    error = bench.ask("SYST:ERR?") if wait_for(lambda: bench.ask("SYST:ERR:COUN?") != "0") else ""
    check("a camera of another source takes no trigger", error.startswith("-2") and "TriggerSource Line0, not On and Software" in error, error)

    check("acquisition stops and starts", bench.ask("ABOR;ACQ?;IMAG:WIDT 32;WIDT?;:TRIG:SOUR Software;SOUR?;:INIT;ACQ?") == "0;32;Software;1",
          bench.ask("SYST:ERR:ALL?"))
    frames = []
    for _ in range(3):
        wait_for(lambda: int(bench.ask("STAT:OPER:COND?")) & 0x20)
        frames.append(bench.ask("*CLS;*TRG;*OPC?;TRIG:RES?;*ESR?").split(";"))
    check("triggers make frames, one after the other", [frame[1].split(",")[0] for frame in frames] == ["1", "2", "3"] and
          all(frame[0] == "1" and frame[1].split(",")[1] in ("complete", "late") and frame[2] == "0" for frame in frames), frames)
    edges = [int(frame[1].split(",")[3]) for frame in frames]
    check("edges are instants of TAI, in order", edges == sorted(edges) and abs(edges[0] / 1e9 - 37 - time.time()) < 1000, edges)
    wait_for(lambda: int(other.ask("STAT:OPER:COND?")) & 0x20)
    other.write("*CLS;*TRG;*OPC")
    check("*OPC tells of the end", wait_for(lambda: int(other.ask("*ESR?")) & 1) and other.ask("FRAM?") == "4")
    catalogue = bench.ask("COUN:CAT?").replace('"', "").split(",")
    counters = dict(zip(catalogue, bench.ask("COUN?").split(",")))
    check("counters are those of the state", int(counters["complete"]) >= 4 and bench.ask('COUN? "complete"') == counters["complete"], counters)
    check("latencies too", len(bench.ask('LAT? "trigger_to_first_row"').split(",")) == 4)
    check("the instrument's test tells whether a camera is bad, as rows late on a busy machine make it", wait_for(lambda: bench.ask(
        "*TST?;HEAL?") in ("0;good", "0;idle", "1;bad")), bench.ask("*TST?;HEAL?;VERD?"))
    bench.write("TRIG:SOUR Line0")


def served(instrument):
    """Whether there is room for one more."""
    one = Bench(instrument.port)
    try:
        return one.ask("*OPC?") == "1"
    except ConnectionError:
        return False
    finally:
        one.file.close()
        one.socket.close()


def refusals(folder, instrument, port_view):
    view = Bench(port_view)
    check("a port for queries changes nothing", view.ask("GAIN?;*TRG;SYST:ERR?").split(";")[1].startswith("-203"))
    crowd = [socket.create_connection(("127.0.0.1", port_view), PATIENCE_S) for _ in range(8)]
    check("those who only ask leave places", crowd[-1].recv(1) == b"" and served(instrument))
    for one in crowd:
        one.close()
    bench = Bench(instrument.port)
    bench.write("X" * 5000)
    check("a line that is too long is thrown away", bench.error() == -363 and bench.ask("*ESE?") == "0")
    crowd = []

    def six():
        one = Bench(instrument.port)
        try:
            crowd.extend([one] if one.ask("*OPC?") == "1" else [])
        except ConnectionError:
            pass
        return len(crowd) == 6

    check("which others take when they have gone", wait_for(six))
    extra = socket.create_connection(("127.0.0.1", instrument.port), PATIENCE_S)
    check("the ninth client is sent away", extra.recv(1) == b"")
    check("eight are served", all(one.ask("*OPC?") == "1" for one in crowd + [bench, view]))
    for one in crowd + [view]:
        one.socket.shutdown(socket.SHUT_RDWR)
    check("those who leave make room", wait_for(lambda: served(instrument)))
    endless = socket.create_connection(("127.0.0.1", instrument.port), PATIENCE_S)

    def flood():
        try:
            endless.sendall(b"A" * 4096)
            return False
        except ConnectionError:
            return True

    check("a line without end ends the connection", wait_for(flood))
    dice = random.Random(3)
    seeds = [b'FEAT "ExposureTime",5 MS;:SYST:ERR?\n', b"*ESE #H2F;*OPC?;TRIG:SOUR?\n", b'STAT:OPER:ENAB 5;:COUN? "late"\n', b"EXP? MAX;*STB?\n"]
    wait_for(lambda: served(instrument))
    hostile = Bench(instrument.port)
    hostile.socket.settimeout(0.01)
    sent = 0
    for _ in range(3000):
        line = bytearray(dice.choice(seeds))
        for _ in range(dice.randrange(5)):
            line[dice.randrange(len(line))] = dice.randrange(256)
        try:
            hostile.socket.sendall(line)
            sent += 1
            if sent % 50 == 0:
                hostile.socket.recv(65536)
        except TimeoutError:
            pass
        except ConnectionError:
            break
    check("mutated lines leave others in peace", sent > 0 and bench.ask("*CLS;*IDN?").startswith("Obscura"))
    check("and memory bounded", instrument.resident_kib() < 64 * 1024, instrument.resident_kib())
    for arguments in (["--scpi", "0.0.0.0:5025"], ["--scpi-view", "192.0.2.1:5025"], ["--lxi", "0.0.0.0:0"], ["--telecommands", "0.0.0.0:0"]):
        refused = subprocess.run([program, "--scpi", "127.0.0.1:0", *arguments], capture_output=True, text=True)
        check(f"{arguments[0]} {arguments[1]} is refused without --allow", refused.returncode == 78 and refused.stderr.count("\n") == 1, refused)
    for wrong in ("192.0.2", "192.0.2.0/33", "bench", " , "):
        refused = subprocess.run([program, "--allow", wrong], capture_output=True, text=True)
        check(f'--allow "{wrong}" is refused', refused.returncode == 64 and "--allow" in refused.stderr, refused)
    refused = subprocess.run([program, "--scpi", "off"], capture_output=True, text=True)
    check("without a port there is nothing to do", refused.returncode == 64, refused)


def other_machines(folder):
    """Those that --allow names may come, others may not. Connections to an address of the network come from it, too."""
    address = own_address()
    if address.startswith("127."):
        print("skipped: this machine has no address of a network")
        return
    for allowed, comes in ((address, True), ("203.0.113.77", False)):
        log = folder / f"log-{comes}"
        with log.open("w") as file:
            instrument = Instrument("--allow", allowed, host="0.0.0.0", stderr=file)
        with socket.create_connection((address, instrument.port), PATIENCE_S) as client:
            client.sendall(b"*OPC?\n")
            try:
                answer = client.recv(100)
            except ConnectionError:
                answer = b""
        check(f"with --allow {allowed} another machine is {'served' if comes else 'sent away'}", (answer == b"1\n") == comes, answer)
        check("this machine always is served", Bench(instrument.port).ask("*OPC?") == "1")
        check("it ends well", instrument.end() == 0)
        check("who is sent away is named in the log", (f"instrument: SCPI connection from {address} refused: not in --allow" in log.read_text()) != comes, log.read_text())


def others_programs(instrument):
    """PyVISA by the lines of docs/instrument.md, and lxi-tools."""
    example = re.search(r"\n((?: {4}.*\n)*?    camera = pyvisa.*\n(?: {4}.*\n)*)", (source / "docs/instrument.md").read_text())
    lines = textwrap.dedent(example.group(1)).replace("::5025::", f"::{instrument.port}::")
    try:
        import pyvisa
    except ImportError:
        print("skipped: PyVISA is not installed")
    else:
        told = []
        exec(lines, {"pyvisa": pyvisa, "print": told.append})
        check("the lines of docs/instrument.md work with PyVISA", len(told) == 2 and re.fullmatch(r"\d+,(complete|late),\d+,\d{19},[\d.e-]+", told[0]) and
              told[1] == '0,"No error"', told)
    if not shutil.which("lxi"):
        print("skipped: lxi-tools are not installed")
        return
    told = subprocess.run(["lxi", "scpi", "-a", "127.0.0.1", "-p", str(instrument.port), "-r", "*IDN?"], capture_output=True, text=True).stdout
    check("lxi-tools get the identity", told.startswith("Obscura,obscura-instrument,0,"), told)


def lxi_identity(instrument):
    space = "{http://www.lxistandard.org/InstrumentIdentification/1.0}"
    answer = urllib.request.urlopen(f"http://127.0.0.1:{instrument.lxi}/lxi", timeout=PATIENCE_S)
    root = ElementTree.fromstring(answer.read())
    # Names and order of the schema.
    check("the LXI identification is found by /lxi", answer.url.endswith("/lxi/identification") and answer.headers["Content-Type"] == "text/xml" and
          root.tag == space + "LXIDevice" and [one.tag.removeprefix(space) for one in root] == [
              "Manufacturer", "Model", "SerialNumber", "FirmwareRevision", "ManufacturerDescription", "IdentificationURL", "Interface", "LXIVersion"])
    interface = root.find(space + "Interface")
    check("its interface is the port of SCPI", [one.tag.removeprefix(space) for one in interface] == [
        "InstrumentAddressString", "Hostname", "IPAddress", "SubnetMask", "MACAddress", "Gateway", "DHCPEnabled", "AutoIPEnabled"] and
          interface[0].text == f"TCPIP::127.0.0.1::{instrument.port}::SOCKET" and interface.get("InterfaceType") == "LXI")
    check("it says what *IDN? says", Bench(instrument.port).ask("*IDN?").split(",") == [root[i].text for i in range(4)])
    announced = set(re.findall(r"FirmwareVersion=(.*?)<", (source / "config/instrument/obscura-avahi.service").read_text()))
    check("the file for mDNS has its version", announced == {root[3].text}, announced)
    dice = random.Random(4)
    idle = [socket.create_connection(("127.0.0.1", instrument.lxi), PATIENCE_S) for _ in range(20)]
    for _ in range(200):
        with socket.create_connection(("127.0.0.1", instrument.lxi), PATIENCE_S) as rude:
            try:
                rude.sendall(dice.randbytes(dice.randrange(8000)) + dice.choice([b"", b"\r\n\r\n"]))
            except ConnectionError:
                pass

    def alive():
        try:
            return urllib.request.urlopen(f"http://127.0.0.1:{instrument.lxi}/lxi/identification", timeout=PATIENCE_S).status == 200
        except OSError:
            return False

    check("it outlives those who say nothing or nonsense", wait_for(alive) and idle[0].recv(1) == b"")


def reference_page():
    page = subprocess.run([program, "--describe", "scpi"], capture_output=True, text=True, check=True).stdout
    check("docs/reference/scpi.md is that of the table (obscura-instrument --describe scpi)",
          page == (source / "docs/reference/scpi.md").read_text())


with tempfile.TemporaryDirectory(prefix="obscura-scpi-") as name:
    folder = pathlib.Path(name)
    calls = str(folder / "calls.socket")
    camera = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{calls}"\n[daemon]\nrun = 0\n')
    view_port = socket.create_server(("127.0.0.1", 0))
    view = view_port.getsockname()[1]
    view_port.close()
    instrument = Instrument("--socket", camera.socket, "--scpi-view", f"127.0.0.1:{view}")
    bench = Bench(instrument.port)
    check("without a daemon it says so", bench.ask("*TST?;EXP?;SYST:ERR?").startswith("2;-241,"), bench.ask("SYST:ERR:ALL?"))
    daemon = camera.start()
    check("a daemon that comes is found by its monitor", wait_for(lambda: bench.ask("*TST?") != "2"))
    bench.write("*CLS")
    conversation(bench, Bench(instrument.port), calls)
    others_programs(instrument)
    other_machines(folder)
    daemon.kill()
    daemon.wait()
    check("one that has gone is missed", bench.ask("GAIN?;SYST:ERR?").startswith("-241,"), bench.ask("SYST:ERR:ALL?"))
    daemon = camera.start()
    check("and found again", wait_for(lambda: bench.ask("*TST?") != "2") and bench.ask("GAIN?") == "0")
    bench.socket.close()
    bench.file.close()
    lxi_identity(instrument)
    refusals(folder, instrument, view)
    reference_page()
    check("it ends well", instrument.end() == 0)
    daemon.terminate()
    check("and so does the daemon", daemon.wait(PATIENCE_S) == 0)
sys.exit(end())
