# SPDX-License-Identifier: Apache-2.0
"""Packets as OpenC3 COSMOS has them: of the files cmd.txt and tlm.txt of a target, and nothing else."""
import shlex
import struct

# Words of a line behind its name: bits, type, then what the keyword adds, then the description.
ADDED = {"APPEND_ITEM": (), "APPEND_ID_ITEM": ("id",), "APPEND_PARAMETER": ("least", "most", "default"),
         "APPEND_ID_PARAMETER": ("least", "most", "default")}


def packets_of(text):
    """[(name, items)] of all TELEMETRY or COMMAND lines; an item is a dictionary."""
    packets = []
    for line in text.splitlines():
        words = shlex.split(line.replace("<%= target_name %>", "OBSCURA"), comments=True)
        if not words:
            continue
        keyword, rest = words[0], words[1:]
        if keyword in ("TELEMETRY", "COMMAND"):
            _, name, endianness, _ = rest
            assert endianness == "BIG_ENDIAN", line
            packets.append((name, []))
        elif keyword in ADDED:
            name, bits, kind, *values = rest
            assert len(values) == len(ADDED[keyword]) + 1 and kind in ("UINT", "INT", "FLOAT"), line
            item = {"name": name, "bits": int(bits), "kind": kind, "states": {}, "identifies": "_ID_" in keyword}
            item |= {key: float(value) for key, value in zip(ADDED[keyword], values)}
            packets[-1][1].append(item)
        elif keyword == "STATE":
            label, value = rest
            packets[-1][1][-1]["states"][label] = int(value)
        else:
            assert keyword == "UNITS" and len(rest) == 2, line
    return packets


class CosmosTarget:
    def __init__(self, telemetry, commands):
        self.telemetry, self.commands = packets_of(telemetry), dict(packets_of(commands))

    def read(self, packet):
        """Name and values of the packet whose identifying items are those of the bytes."""
        bits = "".join(f"{byte:08b}" for byte in packet)
        for name, items in self.telemetry:
            values, position = {}, 0
            for item in items:
                raw = bits[position:position + item["bits"]]
                number = int(raw, 2)
                if item["kind"] == "FLOAT":
                    number = struct.unpack(">f" if item["bits"] == 32 else ">d", number.to_bytes(item["bits"] // 8, "big"))[0]
                elif item["kind"] == "INT" and raw[0] == "1":
                    number -= 1 << item["bits"]
                if item["identifies"] and number != item["id"]:
                    break
                values[item["name"]] = next((label for label, value in item["states"].items() if value == number), number)
                position += item["bits"]
            else:
                assert position == len(bits), (name, position, len(bits))
                return name, values
        raise AssertionError(packet)

    def make(self, command, **arguments):
        """The bytes of a command; what is not given has its default. Refuses what is out of range, as COSMOS does."""
        bits = ""
        for item in self.commands[command]:
            value = arguments.pop(item["name"], item["default"])
            value = item["states"].get(value, value)
            if not item["least"] <= value <= item["most"]:
                raise ValueError(f"{command} {item['name']} {value}")
            number = int.from_bytes(struct.pack(">d", value), "big") if item["kind"] == "FLOAT" else int(value)
            bits += f"{number:0{item['bits']}b}"
        assert not arguments, arguments
        return int(bits, 2).to_bytes(len(bits) // 8, "big")
