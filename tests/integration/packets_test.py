#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Space packets of obscura-instrument, read and made by the XTCE description alone: housekeeping is the daemon's state,
each frame is reported once, telecommands reach the camera, and what is no packet does no harm. The files of OpenC3 COSMOS say
the same of every packet, and Wireshark of headers.

Usage: packets_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD OBSCURA-INSTRUMENT
Exit status 1 if a check failed, 77 without numpy.
"""
import math
import os
import pathlib
import random
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from client_checks import PATIENCE_S, check, end, obscura_client, source, wait_for  # noqa: E402
from cosmos_target import CosmosTarget  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad, program = (os.path.abspath(argument) for argument in sys.argv[3:5])
XTCE = "{http://www.omg.org/spec/XTCE/20180204}"
EPOCH_1970_S = 4383 * 86400  # after 1958
NS = 10**9
CLOCKS_NS = 10**6  # more than the resolution of time codes, and what the difference of two clocks is known to


def made_ns(values):
    """TAI since 1970 at which the packet was made, as its time code says."""
    return (values["TIME_SECONDS"] - EPOCH_1970_S) * NS + (values["TIME_FRACTION"] * NS >> 24)


def tai_ns():
    """The daemon's TAI: where the kernel has no offset from UTC it takes that of the leap second list, 37 s since 2017."""
    tai = time.clock_gettime_ns(time.CLOCK_TAI)
    return tai if abs(tai - time.time_ns()) > NS else tai + 37 * NS


# What XTCE 1.2 allows where this description uses it: children in their order ("*": in any), and attributes.
STRUCTURE = {
    "SpaceSystem": ("TelemetryMetaData CommandMetaData", "name shortDescription"),
    "TelemetryMetaData": ("ParameterTypeSet ParameterSet ContainerSet", ""),
    "ParameterTypeSet": ("* IntegerParameterType EnumeratedParameterType FloatParameterType", ""),
    "IntegerParameterType": ("UnitSet IntegerDataEncoding", "name signed sizeInBits"),
    "EnumeratedParameterType": ("UnitSet IntegerDataEncoding EnumerationList", "name"),
    "FloatParameterType": ("UnitSet FloatDataEncoding", "name sizeInBits"),
    "UnitSet": ("Unit", ""), "Unit": ("", ""),
    "IntegerDataEncoding": ("", "encoding sizeInBits"), "FloatDataEncoding": ("", "sizeInBits"),
    "EnumerationList": ("Enumeration", ""), "Enumeration": ("", "label value"),
    "ParameterSet": ("Parameter", ""), "Parameter": ("", "name parameterTypeRef shortDescription"),
    "ContainerSet": ("SequenceContainer", ""), "SequenceContainer": ("EntryList BaseContainer", "abstract name shortDescription"),
    "EntryList": ("* ParameterRefEntry ArgumentRefEntry FixedValueEntry", ""), "ParameterRefEntry": ("", "parameterRef"),
    "ArgumentRefEntry": ("", "argumentRef"), "FixedValueEntry": ("", "binaryValue name sizeInBits"),
    "BaseContainer": ("RestrictionCriteria", "containerRef"), "RestrictionCriteria": ("ComparisonList", ""), "ComparisonList": ("Comparison", ""),
    "Comparison": ("", "parameterRef useCalibratedValue value"),
    "CommandMetaData": ("ArgumentTypeSet MetaCommandSet", ""),
    "ArgumentTypeSet": ("* IntegerArgumentType EnumeratedArgumentType FloatArgumentType", ""),
    "IntegerArgumentType": ("UnitSet IntegerDataEncoding ValidRangeSet", "name signed sizeInBits"),
    "EnumeratedArgumentType": ("UnitSet IntegerDataEncoding EnumerationList", "name"),
    "FloatArgumentType": ("UnitSet FloatDataEncoding ValidRangeSet", "name sizeInBits"),
    "ValidRangeSet": ("ValidRange", ""), "ValidRange": ("", "maxInclusive minInclusive"),
    "MetaCommandSet": ("MetaCommand", ""), "MetaCommand": ("ArgumentList CommandContainer", "name shortDescription"),
    "ArgumentList": ("Argument", ""), "Argument": ("", "argumentTypeRef initialValue name shortDescription"),
    "CommandContainer": ("EntryList", "name"),
}


def misplaced(root):
    """Elements of an XTCE file that stand where they may not, have what they may not, or refer to nothing."""
    wrong = []
    for element in root.iter():
        name = element.tag.removeprefix(XTCE)
        children, attributes = STRUCTURE[name]
        order = children.split()
        places = [order.index(child.tag.removeprefix(XTCE)) for child in element]
        if not set(element.attrib) <= set(attributes.split()) or (order[:1] != ["*"] and places != sorted(places)):
            wrong.append(name)
    names = {kind: [one.get("name") for one in root.iter(XTCE + kind)] for kind in ("Parameter", "SequenceContainer", "MetaCommand")}
    types = {kind: [one.get("name") for one in root.iter() if one.tag.endswith(kind)] for kind in ("ParameterType", "ArgumentType")}
    wrong += [f"twice: {one}" for all_of in (*names.values(), *types.values()) for one in set(all_of) if all_of.count(one) > 1]
    for attribute, there in (("parameterTypeRef", types["ParameterType"]), ("argumentTypeRef", types["ArgumentType"]), ("parameterRef", names["Parameter"]),
                             ("containerRef", names["SequenceContainer"])):
        wrong += [f"{attribute} {one.get(attribute)}" for one in root.iter() if one.get(attribute, there[0]) not in there]
    return wrong


def describe(what):
    return subprocess.run([program, "--describe", what], capture_output=True, text=True, check=True).stdout


class Description:
    """Packets as a ground system has them: of the XTCE file, and nothing else."""

    def __init__(self, text):
        root = ElementTree.fromstring(text)
        self.types = {one.get("name"): self.type(one) for one in root.iter() if one.tag.endswith("ParameterType")}
        self.arguments = {one.get("name"): self.type(one) for one in root.iter() if one.tag.endswith("ArgumentType")}
        self.references = {one.get("name"): one.get("parameterTypeRef") for one in root.iter(XTCE + "Parameter")}
        self.containers = {one.get("name"): one for one in root.iter(XTCE + "SequenceContainer")}
        self.commands = {one.get("name"): one for one in root.iter(XTCE + "MetaCommand")}

    @staticmethod
    def type(element):
        labels = {int(one.get("value")): one.get("label") for one in element.iter(XTCE + "Enumeration")}
        integer = element.find(XTCE + "IntegerDataEncoding")
        if integer is None:
            return int(element.find(XTCE + "FloatDataEncoding").get("sizeInBits")), "float", labels
        return int(integer.get("sizeInBits")), integer.get("encoding"), labels

    def fields(self, name, bits, position):
        """Values of a container, its base first, and where the next one begins; nothing if it is not that kind."""
        container, values = self.containers[name], {}
        base = container.find(XTCE + "BaseContainer")
        if base is not None:
            values, position = self.fields(base.get("containerRef"), bits, position)
            for one in base.iter(XTCE + "Comparison"):
                if values is None or values[one.get("parameterRef")] != int(one.get("value")):
                    return None, position
        for entry in container.find(XTCE + "EntryList"):
            parameter = entry.get("parameterRef")
            size, kind, labels = self.types[self.references[parameter]]
            raw = bits[position:position + size]
            number = int(raw, 2)
            if kind == "float":
                number = struct.unpack(">f" if size == 32 else ">d", number.to_bytes(size // 8, "big"))[0]
            elif kind == "twosComplement" and raw[0] == "1":
                number -= 1 << size
            values[parameter] = labels.get(number, number)
            position += size
        return values, position

    def read(self, packet):
        bits = "".join(f"{byte:08b}" for byte in packet)
        for name, container in self.containers.items():
            if container.get("abstract") != "true":
                values, position = self.fields(name, bits, 0)
                if values is not None:
                    assert position == len(bits), (name, position, len(bits))
                    return name, {key.removeprefix(name + "_"): value for key, value in values.items()}
        raise AssertionError(packet)

    def make(self, name, sequence, **arguments):
        """A telecommand, with its sequence count put in as a ground system does."""
        packet = b""
        for entry in self.commands[name].find(f"{XTCE}CommandContainer/{XTCE}EntryList"):
            if entry.tag == XTCE + "FixedValueEntry":
                packet += bytes.fromhex(entry.get("binaryValue")).rjust(int(entry.get("sizeInBits")) // 8, b"\0")
                continue
            size, kind, labels = self.arguments[entry.get("argumentRef")]
            value = arguments.get(entry.get("argumentRef"), 0)
            if labels and isinstance(value, str):
                value = next(number for number, label in labels.items() if label == value)
            packet += struct.pack(">d", value) if kind == "float" else int(value).to_bytes(size // 8, "big")
        return packet[:2] + (0xC000 | sequence).to_bytes(2, "big") + packet[4:]


class Ground:
    """Takes telemetry and sends telecommands."""

    def __init__(self, calls):
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.receiver.bind(("127.0.0.1", 0))
        self.receiver.settimeout(PATIENCE_S)
        port = self.receiver.getsockname()[1]
        self.process = Child([program, "--control", calls, "--scpi", "off", "--telemetry", f"127.0.0.1:{port}",
                                         "--telecommands", "127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
        self.commands = ("127.0.0.1", int(self.process.stdout.readline().rpartition(":")[2]))
        self.description = Description(describe("xtce"))
        self.cosmos = CosmosTarget(describe("cosmos-telemetry"), describe("cosmos-commands"))
        self.packets, self.raw, self.sequence = [], [], 0

    def take(self):
        self.raw.append(self.receiver.recv(2048))
        self.packets.append(self.description.read(self.raw[-1]))
        return self.packets[-1]

    def next(self, wanted, condition=lambda values: True):
        """The next packet of that kind for which the condition holds."""
        limit = time.monotonic() + PATIENCE_S
        while time.monotonic() < limit:
            kind, values = self.take()
            if kind == wanted and condition(values):
                return values
        raise TimeoutError(wanted)

    def send(self, packet):
        self.receiver.sendto(packet, self.commands)

    def first(self, wanted, condition):
        """The first packet of that kind for which the condition holds, from the beginning on."""
        return next((values for values in self.of(wanted) if condition(values)), None) or self.next(wanted, condition)

    def command(self, name, by=None, **arguments):
        """Its report. `by`: made by that target of COSMOS."""
        function = list(self.description.commands).index(name)
        self.send(by.make(name, CCSDS_SEQUENCE=self.sequence, **arguments) if by else self.description.make(name, self.sequence, **arguments))
        sequence, self.sequence = self.sequence, (self.sequence + 1) % 16384
        return self.next("COMMAND", lambda values: (values["COMMAND_SEQUENCE"], values["FUNCTION"]) == (sequence, function))

    def of(self, wanted):
        return [values for kind, values in self.packets if kind == wanted]

    def resident_kib(self):
        return int(pathlib.Path(f"/proc/{self.process.pid}/status").read_text().partition("VmHWM:")[2].split()[0])


def files():
    cosmos = source / "config/instrument/openc3-cosmos-obscura/targets/OBSCURA/cmd_tlm"
    for what, file in (("packets", source / "docs/reference/packets.md"), ("xtce", source / "config/instrument/obscura.xml"),
                       ("cosmos-telemetry", cosmos / "tlm.txt"), ("cosmos-commands", cosmos / "cmd.txt")):
        check(f"{file.name} is that of the table (obscura-instrument --describe {what})", describe(what) == file.read_text())
    check("XTCE has its elements where the schema wants them", not misplaced(ElementTree.fromstring(describe("xtce"))))


def housekeeping(ground, camera):
    values = ground.next("HOUSEKEEPING", lambda one: one["DAEMON_ANSWERS"] == "YES" and one["COMPLETE"] > 3)
    before = camera.state()["cameras"][0]
    later = ground.next("HOUSEKEEPING", lambda one: one["COMPLETE"] >= before["camera"]["complete"])
    after = camera.state()["cameras"][0]
    check("housekeeping is the daemon's state", later["ACQUIRING"] == "YES" and later["CONTROLLED"] == "NO" and later["CLOCK"] == "FREE" and
          later["HEALTH"] in ("GOOD", "BAD") and before["camera"]["triggers"] <= later["TRIGGERS"] <= after["camera"]["triggers"] and
          before["frame_id"] <= later["LAST_FRAME"] <= after["frame_id"] and later["FIRST_ROW_P50"] > 0, (before, later, after))
    check("made once a second", made_ns(later) > made_ns(values) + NS // 2)
    before = tai_ns()
    report = ground.command("NO_OPERATION")
    check("with a time code of TAI since 1958", report["TIME_CODE"] == 31 and
          before - CLOCKS_NS <= made_ns(report) <= tai_ns() + CLOCKS_NS, (before, report))


def telecommands(ground, camera):
    check("a telecommand without an effect is answered", ground.command("NO_OPERATION")["RESULT"] == "DONE")
    check("a setting reaches the camera", ground.command("SET_EXPOSURE", EXPOSURE=2500)["RESULT"] == "DONE" and camera.get("ExposureTime") == 2500)
    check("one out of range does not", ground.command("SET_GAIN", GAIN=1000)["RESULT"] == "OUT_OF_RANGE" and camera.get("Gain") == 0)
    check("nor one of another camera", ground.command("SET_GAIN", CAMERA=7, GAIN=1)["RESULT"] == "OUT_OF_RANGE")
    check("no trigger while Line0 triggers", ground.command("TRIGGER")["RESULT"] == "NOT_NOW")
    stopped = ground.command("STOP")
    check("acquisition stops", stopped["RESULT"] == "DONE" and not camera.state()["cameras"][0]["acquiring"])
    check("and starts with another trigger", ground.command("SET_TRIGGER_SOURCE", SOURCE="SOFTWARE")["RESULT"] == "DONE" and
          ground.command("START")["RESULT"] == "DONE" and camera.get("TriggerSource") == "Software")
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    before = tai_ns()
    report = ground.command("TRIGGER")
    check("a trigger is answered when its frame has left", report["RESULT"] == "DONE" and report["FRAME"] == 1, report)
    frame = ground.first("FRAME", lambda one: (one["ACQUISITION"], one["FRAME"]) == (2, 1))
    check("its edge lies between telecommand and answer", before - CLOCKS_NS <= frame["EDGE_TAI_NS"] <= made_ns(report) + CLOCKS_NS, (before, frame, report))
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    report = ground.command("TRIGGER", by=ground.cosmos)
    check("one by the files of COSMOS makes the next frame", report["RESULT"] == "DONE" and report["FRAME"] == 2, report)
    for what, packet, wanted in (("of an unknown function", b"\x19\x03\xc0\x64\0\x01\x63\0", "UNKNOWN"), ("cut short", b"\x19\x03\xc0\x65\0\0\x03", "MALFORMED"),
                                 ("with an argument that is no number", b"\x19\x03\xc0\x66\0\x09\x04\0\x7f\xf8" + bytes(6), "MALFORMED")):
        ground.send(packet)
        report = ground.next("COMMAND", lambda one, count=packet[3]: one["COMMAND_SEQUENCE"] == count)
        check(f"a telecommand {what} is refused", report["RESULT"] == wanted, report)
    own = ground.next("HOUSEKEEPING", lambda one: one["COMMANDS_REFUSED"] >= 6)
    check("all of it is counted", own["COMMANDS_DONE"] == 8 and own["COMMAND_GAPS"] == 1, own)
    dice = random.Random(7)
    seed = ground.description.make("SET_EXPOSURE", 0, EXPOSURE=2500)
    for _ in range(20):
        for _ in range(50):  # no more than the sockets have room for
            packet = bytearray(seed[:dice.randrange(len(seed) + 1)] + dice.randbytes(dice.randrange(4)))
            for _ in range(dice.randrange(3)):
                if packet:
                    packet[dice.randrange(len(packet))] = dice.randrange(256)
            ground.send(packet)
        ground.command("NO_OPERATION")
    ground.send(bytes(60000))
    check("1000 mutated datagrams do no harm", ground.command("NO_OPERATION")["RESULT"] == "DONE" and ground.resident_kib() < 65536,
          ground.resident_kib())
    check("a good one undoes them", [ground.command(*one[:1], **one[1])["RESULT"] for one in (
        ("STOP", {}), ("SET_TRIGGER_SOURCE", {"SOURCE": "LINE0"}), ("SET_EXPOSURE", {"EXPOSURE": 2500}), ("START", {}))] == ["DONE"] * 4)


def frames(ground, camera):
    ground.next("FRAME")
    while len(ground.of("FRAME")) < 12:
        ground.take()
    told = camera.call("timing", camera=0, after=0, most=256)
    place = {name: number for number, name in enumerate(told["columns"])}
    rows = {(row[place["acquisition"]], row[place["frame_id"]]): row for row in told["rows"]}
    reports = ground.of("FRAME")
    keys = [(one["ACQUISITION"], one["FRAME"]) for one in reports]
    known = [one for one in reports if (one["ACQUISITION"], one["FRAME"]) in rows]
    check("frames are reported once, in their order", keys == sorted(set(keys)) and len(known) >= 10, keys)
    first = {acquisition: frame for acquisition, frame in reversed(keys)}
    check("none is left out", all(keys[i][1] == keys[i - 1][1] + 1 or keys[i][1] == first[keys[i][0]] == 1 for i in range(1, len(keys))) and
          all(one["LOST_BEFORE"] == 0 for one in reports), keys)
    good = 0
    for one in known:
        row = rows[(one["ACQUISITION"], one["FRAME"])]
        edge = row[place["edge_ns"]] + told["tai_offset_ns"]
        seconds, rest = divmod(one["EDGE_TAI_NS"], NS)
        late = row[place["late_rows"]]
        # The clocks are steered apart meanwhile.
        good += (abs(one["EDGE_TAI_NS"] - edge) < 1e8 and one["TRIGGER"] == row[place["trigger_id"]] and
                 (one["EDGE_SECONDS"], one["EDGE_FRACTION"]) == (seconds + EPOCH_1970_S, (rest << 24) // NS) and
                 math.isclose(one["FIRST_ROW"], (row[place["first_ns"]] - row[place["edge_ns"]]) / 1e3, rel_tol=1e-6) and
                 math.isclose(one["LAST_ROW"], (row[place["last_ns"]] - row[place["edge_ns"]]) / 1e3, rel_tol=1e-6) and
                 one["LATE_ROWS"] == late and one["ROWS"] == row[place["rows"]] and one["OUTCOME"] == ("LATE" if late else "COMPLETE"))
    check("each with the daemon's own time stamps", good == len(known), known[:2])


def early(ground, camera):
    """A report comes while the plain call, which waits for transports, does not have the frame yet."""
    limit, sooner = time.monotonic() + PATIENCE_S, False
    while not sooner and time.monotonic() < limit:
        report = ground.next("FRAME")
        told = camera.call("timing", camera=0, after=0, most=256)
        place = {name: number for number, name in enumerate(told["columns"])}
        listed = {(row[place["acquisition"]], row[place["frame_id"]]) for row in told["rows"]}
        sooner = (report["ACQUISITION"], report["FRAME"]) not in listed
    check("reports do not wait for transports", sooner)


def refused(ground):
    """The packet after one that was refused is sent: the system tells of the refusal in place of sending it."""
    address = ground.receiver.getsockname()
    ground.receiver.close()
    time.sleep(2.5)  # a packet of housekeeping each second, refused as nothing listens
    ground.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ground.receiver.bind(address)
    ground.receiver.settimeout(PATIENCE_S)
    check("a report arrives though the packet before it was refused", ground.command("NO_OPERATION")["RESULT"] == "DONE")


def saturation(ground, camera, folder):
    """The saturated pixels of reports are those of the files of the same frames."""
    camera.set(TestPattern="White")
    counts = []
    while len(counts) < 4:
        report = ground.next("FRAME", lambda one: one["SATURATED"] not in ((0xFFFFFFFF, 0) if len(counts) < 2 else (0xFFFFFFFF,)))
        if len(counts) == 1:
            camera.set(TestPattern="Off")
        run = f"run{report['ACQUISITION']}_" if report["ACQUISITION"] > 1 else ""
        file = folder / "frames" / f"{run}frame_{report['FRAME']:06}.raw"
        wait_for(file.exists)
        pixels = struct.unpack(f"<{64 * 48}H", file.read_bytes())
        counts.append((report["SATURATED"], sum(dn >= 4095 for dn in pixels)))
    check("saturated pixels are counted", all(told == there for told, there in counts) and counts[0][0] > 1000, counts)
    camera.set(TestPattern="Off")


def cosmos(ground):
    """COSMOS and XTCE are written by different code: both read the same in every packet, and make the same commands."""
    def unlike(raw, packet):
        kind, values = ground.cosmos.read(raw)
        return kind != packet[0] or list(values) != list(packet[1]) or any(
            value != packet[1][name] and not (value != value and packet[1][name] != packet[1][name]) for name, value in values.items())

    wrong = [packet for raw, packet in zip(ground.raw, ground.packets) if unlike(raw, packet)]
    check("COSMOS reads the same values", not wrong and len(ground.raw) > 50, wrong[:2])
    arguments = {"SET_EXPOSURE": {"EXPOSURE": 2500}, "SET_GAIN": {"GAIN": 3.5}, "SET_BLACK_LEVEL": {"BLACK_LEVEL": 64},
                 "SET_FRAME_RATE": {"FRAME_RATE": 12.5}, "SET_TRIGGER_SOURCE": {"SOURCE": "LINE3"}}
    commands = list(ground.description.commands)
    differ = [name for name in commands if ground.cosmos.make(name, CAMERA=1, CCSDS_SEQUENCE=77, **arguments.get(name, {})) !=
              ground.description.make(name, 77, CAMERA=1, **arguments.get(name, {}))]
    check("and makes the same commands", list(ground.cosmos.commands) == commands and not differ, differ)


def wireshark(ground, folder):
    if not shutil.which("tshark"):
        print("skipped: tshark is not installed")
        return
    capture = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 101)  # raw IP
    for packet in ground.raw:
        udp = struct.pack(">HHHH", 5302, 5301, 8 + len(packet), 0) + packet
        address = socket.inet_aton("127.0.0.1")
        ip = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, address, address) + udp
        capture += struct.pack("<IIII", 0, 0, len(ip), len(ip)) + ip
    (folder / "packets.pcap").write_bytes(capture)
    fields = ["apid", "type", "secheader", "seqflag", "seqnum", "length"]
    told = subprocess.run(["tshark", "-r", folder / "packets.pcap", "-d", "udp.port==5301,ccsds", "-T", "fields",
                           *(word for field in fields for word in ("-e", f"ccsds.{field}"))], capture_output=True, text=True).stdout
    read = [[int(word, 0) if word else None for word in line.split("\t")] for line in told.splitlines()]
    wanted = [[one[f"CCSDS_{name}"] for name in ("APID", "TYPE", "SECONDARY", "FLAGS", "SEQUENCE", "LENGTH")] for _, one in ground.packets]
    check("Wireshark reads the same headers", read == wanted, (read[:3], wanted[:3]))


with tempfile.TemporaryDirectory(prefix="obscura-packets-") as name:
    files()
    folder = pathlib.Path(name)
    calls = str(folder / "calls.socket")
    small = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{calls}"\n[daemon]\nrun = 0\n')
    ground = Ground(calls)
    check("without a daemon housekeeping says so", ground.next("HOUSEKEEPING")["DAEMON_ANSWERS"] == "NO")
    daemon = small.start()
    ground.next("HOUSEKEEPING", lambda values: values["DAEMON_ANSWERS"] == "YES")
    with obscura_client.connect_camera(calls, timeout_s=PATIENCE_S) as camera:
        housekeeping(ground, camera)
        telecommands(ground, camera)
        early(ground, camera)
        saturation(ground, camera, folder)
        frames(ground, camera)
    daemon.send_signal(signal.SIGSTOP)
    lost = ground.next("HOUSEKEEPING", lambda values: values["DAEMON_ANSWERS"] == "NO")
    check("a daemon that hangs is missed", lost["COMPLETE"] == 0 and lost["HEALTH"] == "UNKNOWN", lost)
    before = len(ground.of("HOUSEKEEPING"))
    check("a telecommand has no answer of it", ground.command("START")["RESULT"] == "DAEMON_LOST")
    check("and housekeeping goes on meanwhile", len(ground.of("HOUSEKEEPING")) >= before + 3, len(ground.of("HOUSEKEEPING")) - before)
    daemon.send_signal(signal.SIGCONT)
    check("until the daemon answers again", ground.next("HOUSEKEEPING", lambda values: values["DAEMON_ANSWERS"] == "YES")["COMPLETE"] > 0)
    first = ground.of("FRAME")[0]
    check("a daemon that came later is reported from its first frame on", (first["ACQUISITION"], first["FRAME"]) == (1, 1), first)
    daemon.kill()
    daemon.wait()
    check("a daemon that has gone is missed", ground.next("HOUSEKEEPING", lambda values: values["DAEMON_ANSWERS"] == "NO")["COMPLETE"] == 0)
    check("and cannot be commanded", ground.command("START")["RESULT"] == "DAEMON_LOST")
    shutil.rmtree(folder / "frames")
    (folder / "frames").mkdir()
    daemon = small.start()
    anew = ground.next("FRAME")
    check("another one is reported from its first frame on", (anew["ACQUISITION"], anew["FRAME"], anew["LOST_BEFORE"]) == (1, 1, 0), anew)
    for kind in ("HOUSEKEEPING", "FRAME", "COMMAND"):
        counts = [one["CCSDS_SEQUENCE"] for one in ground.of(kind)]
        check(f"sequence counts of {kind} have no gap", counts == list(range(len(counts))), counts)
    cosmos(ground)
    wireshark(ground, folder)
    daemon.terminate()
    daemon.wait(PATIENCE_S)
    refused(ground)
    ground.process.terminate()
    ground.process.stdout.close()
    check("it ends well", ground.process.wait(PATIENCE_S) == 0)
sys.exit(end())
