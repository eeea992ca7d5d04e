# SPDX-License-Identifier: Apache-2.0
"""Stand-in for obscura-web with a camera whose frames are known: the page of web/page under its content security policy, the paths of
/api/v1 and the WebSocket of pictures. By itself (page_double.py FOLDER-OF-THE-PAGE [PORT]) it serves the page for work on it."""
import array
import base64
import hashlib
import http.server
import json
import math
import pathlib
import random
import struct
import sys
import threading
import time
import urllib.parse

TOKEN, CAMERA = "known", "4711-0"
TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; base-uri 'none'; "
                               "form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'",
    "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}
BOUNDS_US = [b * 10**d for d in range(6) for b in (1, 2, 5)] + [1e6]
WIDTH, HEIGHT, BITS, BLACK_DN, GAIN_DN_PER_E = 640, 512, 12, 64, 0.08
SUN = (-0.62, -0.55, 0.56)
CENTRE, RADIUS = (372.25, 287.75), 118.5
FIRST_ID, AGE_NS = 90000, 123_000_000  # ids of frames are not their numbers


def known_frame():
    """A lit sphere before stars, row-major."""
    dice = random.Random(7)
    pixels = array.array("H", (max(0, round(dice.gauss(BLACK_DN, 1.2))) for _ in range(WIDTH * HEIGHT)))
    for y in range(int(CENTRE[1] - RADIUS), int(CENTRE[1] + RADIUS) + 1):
        for x in range(int(CENTRE[0] - RADIUS), int(CENTRE[0] + RADIUS) + 1):
            u, v = (x - CENTRE[0]) / RADIUS, (y - CENTRE[1]) / RADIUS
            if u * u + v * v < 1:
                light = u * SUN[0] + v * SUN[1] + math.sqrt(1 - u * u - v * v) * SUN[2]
                rough = 1 + 0.06 * math.sin(11 * u + 7 * v * v) + 0.05 * math.sin(23 * v + 5 * u)
                pixels[y * WIDTH + x] = BLACK_DN + max(0, round(2300 * light * rough + dice.gauss(0, 12) * (light > 0)))
    for _ in range(140):
        x, y, peak = dice.randrange(2, WIDTH - 2), dice.randrange(2, HEIGHT - 2), 10 ** dice.uniform(1.2, 3.9)
        if math.hypot(x - CENTRE[0], y - CENTRE[1]) > RADIUS + 2:
            for dy in -1, 0, 1:
                for dx in -1, 0, 1:
                    i = (y + dy) * WIDTH + x + dx
                    pixels[i] = min(2**BITS - 1, pixels[i] + round(peak * math.exp(-(dx * dx + dy * dy) / 0.98)))
    return pixels


def reduced(pixels, x, y, w, h, bin, reduce):
    """A part of the frame by blocks; those at the edge are smaller."""
    if bin == 1:
        return array.array("H", b"".join(pixels[r * WIDTH + x:r * WIDTH + x + w].tobytes() for r in range(y, y + h)))
    out = array.array("H")
    for by in range(y, y + h, bin):
        rows = [pixels[r * WIDTH + x:r * WIDTH + x + w] for r in range(by, min(by + bin, y + h))]
        for bx in range(0, w, bin):
            block = [v for row in rows for v in row[bx:bx + bin]]
            out.append(max(block) if reduce == "max" else (sum(block) + len(block) // 2) // len(block))
    return out


def histogram_of(pixels):
    ordered, bins = sorted(pixels), [0] * 256
    for v in pixels:
        bins[v >> BITS - 8] += 1
    return {"bins": bins, "saturated": sum(v == 2**BITS - 1 for v in pixels), "min": ordered[0], "max": ordered[-1],
            "mean": sum(pixels) / len(pixels), "p50": ordered[len(ordered) // 2], "p99": ordered[len(ordered) * 99 // 100]}


def latencies(values):
    ordered = sorted(values)
    return {"count": len(ordered), "p50": ordered[len(ordered) // 2], "p99": ordered[len(ordered) * 99 // 100], "max": ordered[-1], "sum": sum(ordered),
            "up_to": [sum(v <= b for v in ordered) for b in BOUNDS_US]}


def first_features():
    def row(name, value, type, help, **more):
        return {"name": name, "value": value, "type": type, "help": help, "locked": False, **more}
    return {r["name"]: r for r in [
        row("Width", WIDTH, "integer", "Width of the image; not during acquisition", unit="px", allowed="32 to 640 px", increment=4),
        row("Height", HEIGHT, "integer", "Height of the image; not during acquisition", unit="px", allowed="2 to 512 px", increment=2),
        row("OffsetX", 0, "integer", "First column of the image on the sensor", unit="px", allowed="0 to 640 px", increment=4),
        row("OffsetY", 0, "integer", "First row of the image on the sensor", unit="px", allowed="0 to 512 px", increment=2),
        row("PixelFormat", "Mono12", "string", "Format in which GigE Vision sends the pixels; not during acquisition", allowed="Mono8 | Mono10 | Mono12 | Mono12p | Mono16"),
        row("ExposureTime", 16000.0, "number", "Integration time of each row", unit="us", allowed="10 to 10000000 us"),
        row("Gain", 0.0, "number", "Gain of the amplifier", unit="dB", allowed="0 to 24 dB"),
        row("BlackLevel", float(BLACK_DN), "number", "Digital number of a dark pixel", unit="DN", allowed="0 to 1000 DN"),
        row("AcquisitionFrameRateEnable", False, "true or false", "Whether AcquisitionFrameRate holds; else the free run has the highest rate of the sensor"),
        row("TriggerMode", "On", "string", "Whether a trigger starts each frame; Off: free run", allowed="On | Off"),
        row("TriggerSource", "Line0", "string", "Source of the trigger; camera.trigger is Software, Line0 is driven by [trigger]", allowed="Software | Line0 | Action0"),
    ]}


def device_features():
    """Features that only the GigE Vision side has, some of them."""
    def row(name, category, type, value, **more):
        return {"name": name, "category": category, "type": type, "value": value, "visibility": "Beginner", "writable": True, "locked": False, **more}
    sets = ["Default", "UserSet1"]
    return {r["name"]: r for r in [
        row("DeviceModelName", "DeviceControl", "string", "Obscura", writable=False),
        row("DeviceUserID", "DeviceControl", "string", "bench 3"),
        row("DeviceTemperature", "DeviceControl", "float", 20.0, unit="C", writable=False, visibility="Expert", help="Sensor temperature as configured"),
        row("DeviceReset", "DeviceControl", "command", None, visibility="Guru"),
        row("Width", "ImageFormatControl", "integer", WIDTH),
        row("TriggerMode[FrameStart]", "AcquisitionControl", "enumeration", "On", entries=["Off", "On"]),
        row("TriggerMode[AcquisitionStart]", "AcquisitionControl", "enumeration", "Off", entries=["Off", "On"], locked=True),
        row("CounterValue[Counter0]", "CounterAndTimerControl", "integer", 0, min=0, max=4294967295),
        row("UserSetSelector", "UserSetControl", "enumeration", "Default", entries=sets),
        row("UserSetLoad", "UserSetControl", "command", None),
        row("UserSetSave", "UserSetControl", "command", None),
        row("UserSetDefault", "UserSetControl", "enumeration", "Default", entries=sets),
        row("GevSCPSPacketSize", "GigEVision", "integer", 1500, unit="B", min=576, max=9000, writable=False),
    ]}


FAULT_PARAMETERS = [
    {"name": "kind", "type": "string", "required": True, "help": "What goes wrong"}, {"name": "percent", "unit": "%", "default": 100, "help": "Share that is struck"}, {"name": "first", "default": 1, "help": "First frame or command"},
    {"name": "last", "default": 0, "help": "Last one; 0: no end"}, {"name": "every", "default": 1, "help": "Only every so many"},
    {"name": "seed", "type": "integer", "default": "0", "help": "Seed of random choices; 0: that of the daemon"},
    {"name": "burst_packets", "default": 1, "help": "Packets in a row"}, {"name": "amount", "default": 1, "help": "us or ids"}]
KINDS = [{"name": name, "help": help} for name, help in [("lose", "Payload packets are withheld when first sent; a resend brings them"), ("lose_for_good", "Payload packets are withheld, also in resends"),
                       ("skip_frame", "The frame is not sent"), ("freeze_frame", "The picture of the last frame that was not struck"),
                       ("wrong_timestamp", "The time stamp is off by the amount"), ("mute_control", "Commands are not answered")]]


class PageDouble:
    """`role`: of the only token. `asked`: (method, path, body) of what has been changed. `refuse`: path's end -> (status, detail).
    `beat()` makes the next frame; the server does it five times a second while `runs`."""

    def __init__(self, folder, role="operator", port=0):
        self.lock = threading.Condition()
        self.folder, self.role, self.asked, self.refuse, self.runs = pathlib.Path(folder).resolve(), role, [], {}, True
        self.pixels, self.cache = known_frame(), {}
        self.jpeg, self.truths, self.requests = None, [], 0  # what views with "auto" get; frames whose truth was asked for, None: the newest; requests of /api/
        self.kept, self.probed = {}, None  # frames that were shown: (pixels, width, height)
        self.histogram = histogram_of(self.pixels)
        self.features, self.acquiring, self.controller, self.shown = first_features(), True, "", "demo"
        self.device, self.log_level, self.lockstep, self.pixel_deg = device_features(), "info", False, 0.01
        self.rules, self.frame, self.first = [], 811, time.monotonic()
        self.dice, self.timing, self.sockets = random.Random(3), [], []
        for frame in range(400, self.frame + 1):
            self.timing.append(self.timed(frame))
        double = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def log_message(self, *_):
                pass

            def do_GET(self):
                double.answer(self)
            do_PUT = do_PATCH = do_POST = do_GET

        class Server(http.server.ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, *_):  # of a browser that has gone
                pass
        self.server = Server(("127.0.0.1", port), Handler)
        self.port = self.server.server_address[1]
        self.link = f"http://127.0.0.1:{self.port}/#token={TOKEN}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        threading.Thread(target=self.tick, daemon=True).start()

    def close(self):
        self.runs = None
        self.server.shutdown()
        self.server.server_close()

    @property
    def runs(self):
        return self._runs

    @runs.setter
    def runs(self, on):
        with self.lock:  # no frame comes any more once this is False
            self._runs = on

    def tick(self):
        while self.runs is not None:
            time.sleep(0.2)
            with self.lock:
                if self.runs and self.acquiring:
                    self.beat()

    def beat(self):
        with self.lock:
            self.frame += 1
            self.timing.append(self.timed(self.frame))
            self.lock.notify_all()

    def timed(self, frame):
        edge, dice = 1_000_000_000_000 + frame * 200_000_000, self.dice
        late = 9_000_000 if frame % 173 == 0 else int(dice.lognormvariate(7, 1))
        stages = [edge + int(us * 1000) for us in (dice.lognormvariate(3, .3), dice.lognormvariate(4, .3), 300 + dice.random() * 90, 9000 + 3000 * dice.random(), 13000 + 3000 * dice.random())]
        return [frame, frame, edge, *stages, edge + 20_000_000, edge + 20_000_000 + late // 3, edge + 96_000_000, edge + 96_000_000 + late, 512, 12 if late > 5e6 else 0,
                late, dice.randrange(512), 1 if late > 5e6 else 0, 0, 1, edge + 20_310_000 + late // 3, edge + 96_400_000 + late]

    TIMING_COLUMNS = ["frame_id", "trigger_id", "edge_ns", "seen_ns", "pose_ns", "render_begin_ns", "render_end_ns", "detector_end_ns", "due_ns", "first_ns", "last_due_ns",
                      "last_ns", "rows", "late_rows", "worst_row_ns", "worst_row", "flags", "stalled_rows", "acquisition", "gige_first_byte_ns", "gige_last_byte_ns"]

    def state(self):
        edge, first, last, worst = (self.TIMING_COLUMNS.index(n) for n in ("edge_ns", "first_ns", "last_ns", "worst_row_ns"))
        rows, late = self.timing, sum(r[13] > 0 for r in self.timing)
        frames = len(rows)
        verdict = ({"health": "idle", "text": "idle: the acquisition is stopped, no client is in control"} if not self.acquiring
                   else {"health": "good", "text": f"on time: 0 late rows in {min(300, frames)} frames, last 60 s"})
        camera = {"id": CAMERA, "address": "192.168.1.5:3956", "controller": self.controller, "acquiring": self.acquiring, "trigger_ready": True, "frame_id": self.frame,
                  "verdict": verdict, "recent": {"seconds": 60, "triggers": 300, "frames": 300, "complete": 300, "late": 0},
                  "clock": {"state": "lockstep", "source": "simulator"} if self.lockstep else {"state": "locked", "source": "pps"}, "trigger": {"refused": 0},
                  "camera": {"run": 5, "triggers": frames + 3, "frames": frames, "complete": frames, "late": late, "late_rows": 12 * late, "stalled": 0, "stalled_rows": 0, "missed_triggers": 3,
                             "missed_because": {"lost_edge": 0, "chip_busy": 2, "rendering": 1, "latch_full": 0, "stopped": 0}, "ignored": 0, "dropped": 0, "abandoned": 0, "quality": {"degraded": 0}},
                  "latency_us": {"trigger_to_first_row": latencies([(r[first] - r[edge]) / 1e3 for r in rows]), "trigger_to_last_row": latencies([(r[last] - r[edge]) / 1e3 for r in rows]),
                                 "release_lateness": latencies([r[worst] / 1e3 for r in rows])},
                  "transports": {"gige": {"submitted": frames, "delivered": frames, "dropped": 0, "bytes": frames * 655360, "packets": frames * 455, "send_errors": 0, "resend_requests": 4,
                                          "resent_packets": 4, 
                                          "stream_to": "192.168.1.20:41000", "packet_bytes": 1500, "refused_packets": 0, "commands": {"received": 211, "denied": 0}, "refused_because": {"queue_full": 0},
                                          **({"controller_silent_s": 0.31} if self.controller else {}), "fault_strikes": {f"rule_{k + 1}_{r['kind']}": 7 for k, r in enumerate(self.rules)}},
                                 "v4l2": {"submitted": frames, "delivered": 0, "dropped": frames, "bytes": 0, "no_node": frames, "node": "/dev/video10",
                                          "trouble": "v4l2: /dev/video10: No such file or directory"},
                                 "file": {"submitted": frames, "delivered": frames, "dropped": 0, "bytes": frames * 655360, "directory": "/var/lib/obscura/frames", "disk_free_bytes": 212 * 2**30, "trouble": ""},
                                 "watch": {"submitted": frames, "delivered": frames - 1, "dropped": 1}}}
        return {"age_s": 0.1, "web": {"version": "0.1.0", "latency_bounds_us": BOUNDS_US}, "error": "",
                "daemons": [{"daemon": {"version": "0.1.0", "pid": 4711, "config": "/etc/obscura/<moon> &amp.toml", "up_s": time.monotonic() - self.first + 7800, "resident_mib": 344.2,
                                        "log_lost": 0, "control": "/run/obscura/calls", "locked_mib": 340.1, "log_level": self.log_level,
                                        "advice": ["Core 3 of the release thread is not isolated: isolcpus=domain,managed_irq,3 nohz_full=3 rcu_nocbs=3 on the kernel's command line.",
                                                   "The kernel is no real-time one: apt install linux-image-rt-amd64."]},
                             "threads": [{"name": n, "policy": p, "priority": q, "nice": 0, "cpu_s": c, "cores": cores, "processor": at} for n, p, q, c, cores, at in
                                         [("obscurad", "other", 0, 3.1, "0-2", 0), ("release", "fifo", 75, 1.9, "3", 3), ("trigger", "fifo", 80, 0.4, "0-3", 2), ("render 0", "other", 0, 211.7, "0-1", 1),
                                          ("calls", "other", 0, 0.6, "0-2", 2)]],
                             "heartbeats": [{"name": "release", "age_s": 0.04, "silent": False}, {"name": "gige-stream", "age_s": 0.11, "silent": False}, {"name": "file-sink", "age_s": 2.2, "silent": True}],
                             "ptp": {"locked": True, "offset_ns": -350, "path_delay_ns": 1240}, "scenes": {"shown": 0, "refused": 0}, "cameras": [camera]}]}

    def probe(self, x, y, frame):
        dn = self.kept[frame][0][y * self.kept[frame][1] + x]
        inside = math.hypot(x - CENTRE[0], y - CENTRE[1]) < RADIUS
        return {"frame": str(frame), "x": x, "y": y, "dn": dn, "electrons": {"estimated": (dn - BLACK_DN) / GAIN_DN_PER_E, "exact": 1234.5}, "formula": "(DN - 64) / 0.08",
                "bands": [{"name": "red", "irradiance_w_m2": 2.5e-6}, {"wavelength_nm": 450, "irradiance_w_m2": 1.5e-6}], "irradiance_w_m2": 4e-6, "body": "asteroid" if inside else None,
                "range_m": 39481.25 if inside else None, "latitude_deg": -12.25 if inside else None, "longitude_deg": 101.5 if inside else None, "incidence_deg": 33.5 if inside else None,
                "emission_deg": 8.25 if inside else None, "phase_deg": 41.0, "row_mid_exposure_tai_ns": "1795000000000000000", "samples": 64}

    def truth(self):
        x, y = CENTRE[0] - self.features["OffsetX"]["value"], CENTRE[1] - self.features["OffsetY"]["value"]
        circle = [[x + RADIUS * math.cos(k * math.pi / 31), y + RADIUS * math.sin(k * math.pi / 31)] for k in range(62)]
        lit = [p[0] * SUN[0] + p[1] * SUN[1] > x * SUN[0] + y * SUN[1] for p in circle]
        return {"frame": str(self.frame), "camera_position_m": [0.0, 0.0, -39500.2], "camera_orientation": [1.0, 0.0, 0.0, 0.0], "sun_position_m": [1.1e11, 0.0, -1.0e11], "camera_pose_age_s": 0.04, "bodies_of": 1, "bodies": [{"name": "asteroid", "x": x, "y": y, "radius_px": RADIUS, "range_m": 39500.2, "position_m": [0.0, 0.0, 0.0],
                                                                      "limb": [*circle, circle[0]], "limb_lit": [*lit, lit[0]],
                                                                      "motion": {"start": {"x": x - 14, "y": y - 2}, "end": {"x": x + 14, "y": y + 2}}}],
                "stars": [{"name": name, "x": sx, "y": sy, "magnitude": m} for name, sx, sy, m in (("Vega", 101.0, 83.5, 0.03), (None, 560.0, 66.0, 3.1), ("Deneb", 87.5, 451.0, 1.25))],
                "windows": [{"name": "window 1", "x": 40, "y": 30, "w": 200, "h": 120}], "hot_pixels": [[300, 40], [601, 333]]}

    def answer(self, request):
        url = urllib.parse.urlsplit(request.path)
        length = int(request.headers.get("Content-Length") or 0)
        body = json.loads(request.rfile.read(length)) if length else None
        if url.path == "/api/v1/live":
            self.live(request)
            return
        if not url.path.startswith("/api/"):
            file = (self.folder / (url.path.lstrip("/") or "index.html")).resolve()
            if url.path == "/messages.txt":
                self.send(request, 200, (self.folder.parents[1] / "systemd/obscura.catalog").read_bytes(), "text/plain; charset=utf-8")
                return
            good = file.is_file() and self.folder in file.parents
            self.send(request, 200 if good else 404, file.read_bytes() if good else b"", TYPES.get(file.suffix, "text/plain"))
            return
        self.requests += 1
        if request.headers.get("Authorization") != f"Bearer {TOKEN}":
            self.problem(request, 401, "this token is not known")
            return
        for end, (status, detail) in self.refuse.items():
            if url.path.endswith(end):
                self.problem(request, status, detail)
                return
        if request.command != "GET":
            self.asked.append((request.command, url.path, body))
        query = dict(urllib.parse.parse_qsl(url.query))
        with self.lock:
            self.route(request, url.path.removeprefix("/api/v1/").removeprefix(f"cameras/{CAMERA}/"), query, body)

    def route(self, request, path, query, body):
        def say(value):
            self.send(request, 200, json.dumps(value).encode(), "application/json")
        command = request.command
        if path == "state":
            say(self.state())
        elif path == "me":
            say({"role": self.role})
        elif path == "events":
            lines = [{"id": k + 1, "utc": f"2026-11-23T19:06:{k:02}.302Z", "level": "warning" if k == 3 else "info", "text": t} for k, t in enumerate(
                ["obscurad 0.1.0 starting with /etc/obscura/<moon> &amp.toml", "camera 0: run word 5, the next one at each further acquisition", "real time: SCHED_FIFO and locked memory",
                 "clock: PPS lost for 1.2 s", "monitor: /run/obscura/obscurad-4711.socket"])]
            lines[0]["message"] = "3d0b89f7f0eb3698a45f0b4fe970cb84"  # of the catalogue: obscurad … starting with …
            say({"events": [line for line in lines if line["id"] > int(query.get("after", 0))]})
        elif path == "audit":
            say({"last": len(self.asked), "changes": [{"id": k + 1, "utc": "2026-11-23T19:07:00Z", "who": self.role, "peer": "127.0.0.1", "what": p.rsplit("/", 1)[1], "camera": CAMERA,
                                                       "before": None, "after": b, "forced": False} for k, (_, p, b) in enumerate(self.asked)]})
        elif path == "features" and command == "PATCH":
            self.change(request, body, say)
        elif path == "features":
            for name in "Width", "Height", "PixelFormat":
                self.features[name]["locked"] = self.acquiring
            say({"features": list(self.features.values()), "readout": {"frame_period_us": 98000.0, "max_rate_hz": 10.204, "readout_us": 97000.0, "row_us": 189.8, "windows": [
                {"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT, "exposure_requested_us": 16000.0, "exposure_min_us": 15940.0, "exposure_max_us": 15940.0, "reads": 1}]}})
        elif path == "acquisition":
            self.acquiring = body["running"]
            say({"running": self.acquiring})
        elif path == "trigger":
            if self.features["TriggerSource"]["value"] != "Software":
                self.problem(request, 409, "camera.trigger: TriggerMode is On and TriggerSource Line0, not On and Software")
            else:
                self.frame += 1
                say({"accepted": True, "edge_tai_ns": "5", "outcome": "complete", "frame": self.frame, "late_rows": 0, "seconds": 0.0961})
        elif path == "timing":
            after = int(query.get("after", 0))
            rows = self.timing[after:][:int(query.get("most", 64))]
            say({"columns": self.TIMING_COLUMNS, "rows": rows, "last": after + len(rows)})
        elif path == "timing/rows":
            row = next(r for r in self.timing if r[0] == int(query["frame"]))
            worst, at = row[self.TIMING_COLUMNS.index("worst_row_ns")] // 1000, row[self.TIMING_COLUMNS.index("worst_row")]
            say({"frame": row[0], "acquisition": 1, "lateness_us": [worst if r == at else r % 3 for r in range(HEIGHT)]})
        elif path == "faults":
            wrong = next((k for k, r in enumerate((body or {}).get("rules", [])) if not 0 <= r.get("percent", 100) <= 100), None)
            if wrong is not None:
                self.problem(request, 422, f"faults.set: rules[{wrong}].percent: {body['rules'][wrong]['percent']}, allowed 0 to 100 %", f"#/rules/{wrong}/percent")
                return
            if command == "PUT":
                self.rules = body["rules"]
            say({"kinds": KINDS, "parameters": FAULT_PARAMETERS, "frame": self.frame, "rules": [{**r, "origin": "call", "struck": 7} for r in self.rules]})
        elif path == "truth":
            self.truths.append(query.get("frame"))
            say({**self.truth(), "frame": self.truths[-1] or str(self.frame - 1)})  # the newest truth need not be that of the picture
        elif path == "scenes":
            say({"shown": self.shown, "scenes": ["demo", "moon", "moon-near"]})
        elif path == "scene" and command == "PUT":
            self.shown = body["file"]
            say({"shown": 1})
        elif path == "scene":
            self.describe(say)
        elif path == "step":
            say({"frame": self.frame, "outcome": "complete", "late_rows": 0})
        elif path == "pose" and body["position_m"][0] > 1e6:
            self.problem(request, 422, "pose: position_m: allowed up to 1e6 m", "#/position_m")
        elif path == "pose" or path == "reload":
            say({})
        elif path == "release":
            freed, self.controller = self.controller, ""
            say({"controller": freed})
        elif path == "log-level":
            before, self.log_level = self.log_level, body["level"]
            say({"level": self.log_level, "before": before})
        elif path == "device" and command == "POST":
            self.write_device(request, *next(iter(body.items())), say)
        elif path == "device":
            say({"features": list(self.device.values())})
        elif path == "support-bundle":
            self.send(request, 200, b"bundle", "application/zstd", {"Content-Disposition": 'attachment; filename="obscura-support-test.tar.zst"'})
        elif path == "configuration":
            say({"sha256": hashlib.sha256(b"").hexdigest(), "entries": [
                {"key": "trigger.source", "value": "pps", "unit": "", "default": "timer", "source": "/etc/obscura/moon.toml:9"}, {"key": "trigger.rate_hz", "value": "5", "unit": "Hz", "source": "--set"},
                {"key": "sensor.detector.gain_dn_per_e", "value": str(GAIN_DN_PER_E), "unit": "DN/e-", "source": "/etc/obscura/moon.toml:31"},
                {"key": "daemon.late_policy", "value": "wait", "unit": "", "source": "default"}]})
        elif path.startswith("frames/"):
            frame = int(path.split("/")[1].split(".")[0]) - FIRST_ID
            if frame not in self.kept:
                self.problem(request, 404, "this frame is not kept")
                return
            pixels, width, height = self.kept[frame]
            self.send(request, 200, pixels.tobytes(), "application/octet-stream",
                      {"X-Obscura-Frame": str(frame), "X-Obscura-Width": str(width), "X-Obscura-Height": str(height), "X-Obscura-Rows": str(height), "X-Obscura-Bits": str(BITS)})
        elif path == "probe":
            self.probed = query
            say(self.probe(int(query["x"]), int(query["y"]), int(query["frame"])))
        else:
            self.problem(request, 404, "the paths are: ...")

    def describe(self, say):
        def placed(name, parent="", **more):
            return {"name": name, "parent": parent, "motion": "trajectory", "source": "scene", "poses_received": 0, "newest_pose_s": None, **more}
        say({"name": "", "file": "/usr/share/obscura/scenes/demo.toml", "scene_time": "nominal", "dated": True, "trajectory_s": [0, 2.5, 4], "sun": {"shines": True, "moves": False},
             "camera": {**placed("camera"), "source": "simulator", "poses_received": 118, "newest_pose_s": 23.5, "width": WIDTH, "height": HEIGHT, "focal_length_m": 0.8, "projection": "pinhole",
                        "field_of_view_deg": [WIDTH * self.pixel_deg, HEIGHT * self.pixel_deg]},
             "bodies": [placed("asteroid", shape="sphere", material="hapke", motion="fixed, spinning"), placed("lander", "asteroid", shape="mesh", material="lambert")],
             "lamps": [placed("flash", "lander")],
             "simulator": {"listen": "127.0.0.1:5003", "connections": 1, "poses": 118, "steps": 0, "refused": 0}})

    def write_device(self, request, name, value, say):
        row = self.device.get(name)
        if row is None or not row["writable"]:
            self.problem(request, 422, f"device.set: {name}: cannot be written here", "#/name")
        elif name == "DeviceUserID" and len(value) > 16:
            self.problem(request, 422, "device.set: DeviceUserID: allowed are up to 16 printable ASCII characters", f"#/{name}")
        else:
            if row["type"] != "command":
                row["value"] = value
            say({"written": name})

    def change(self, request, body, say):
        if self.controller:
            self.problem(request, 409, f"controlled by {self.controller}")
            return
        for name, value in body.items():
            if self.acquiring and name in ("Width", "Height", "PixelFormat") and value != self.features[name]["value"]:
                self.problem(request, 409, f"camera.set: {name} cannot change while the camera acquires")
                return
        changed = {n: v for n, v in body.items() if self.features[n]["value"] != v}
        for name, value in changed.items():
            self.features[name]["value"] = value
        say({"changed": changed})

    def send(self, request, status, body, type, headers=None):
        request.send_response(status)
        for name, value in {**HEADERS, **(headers or {}), "Content-Type": type, "Content-Length": str(len(body))}.items():
            request.send_header(name, value)
        request.end_headers()
        request.wfile.write(body)

    def problem(self, request, status, detail, pointer=""):
        errors = {"errors": [{"pointer": pointer, "detail": detail}]} if pointer else {}
        self.send(request, status, json.dumps({"type": "urn:obscura:double", "title": "no", "status": status, "detail": detail, **errors}).encode(), "application/problem+json")

    # WebSocket: frames of RFC 6455 as far as the page sends them, which are short.

    def live(self, request):
        if request.headers.get("Sec-WebSocket-Protocol") != "obscura.v1" or "live" in self.refuse:
            self.problem(request, 404, "the paths are: ...")
            return
        key = hashlib.sha1((request.headers["Sec-WebSocket-Key"] + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()
        request.send_response(101)
        for name, value in {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Accept": base64.b64encode(key).decode(), "Sec-WebSocket-Protocol": "obscura.v1"}.items():
            request.send_header(name, value)
        request.end_headers()
        request.close_connection = True
        told = {"view": None, "ready": True, "open": True}
        threading.Thread(target=self.listen, args=(request, told), daemon=True).start()
        sent = histogram_at = 0
        while told["open"] and self.runs is not None:
            with self.lock:
                if not self.lock.wait_for(lambda: told["view"] and told["ready"] and (self.frame > sent or told["fresh"]), 0.2):
                    continue
                skipped, sent, view = max(0, self.frame - sent - 1) if sent else 0, self.frame, told["view"]
                told["ready"] = told["fresh"] = False
            try:
                self.push(request, 2, self.picture(view, sent, skipped))
                if time.monotonic() - histogram_at > 0.5:
                    histogram_at = time.monotonic()
                    self.push(request, 1, json.dumps({"histogram": {"frame": str(sent), **self.histogram}}).encode())
            except OSError:
                return

    def listen(self, request, told):
        try:
            while True:
                first, second = request.rfile.read(2)
                size = second & 127
                if size == 126:
                    size = struct.unpack(">H", request.rfile.read(2))[0]
                mask = request.rfile.read(4)
                text = bytes(b ^ mask[i % 4] for i, b in enumerate(request.rfile.read(size)))
                if first & 15 == 8:
                    break
                message = json.loads(text)
                with self.lock:
                    if "view" in message:
                        told["view"], told["fresh"] = message["view"], True
                    told["ready"] |= bool(message.get("ready"))
                    self.lock.notify_all()
        except (OSError, ValueError):
            pass
        told["open"] = False

    def push(self, request, opcode, data):
        head = bytes([0x80 | opcode]) + (bytes([len(data)]) if len(data) < 126 else struct.pack(">BH", 126, len(data)) if len(data) < 65536 else struct.pack(">BQ", 127, len(data)))
        request.wfile.write(head + data)
        request.wfile.flush()

    def picture(self, view, frame, skipped):
        left, top, width, height = (self.features[n]["value"] for n in ("OffsetX", "OffsetY", "Width", "Height"))
        x, y = min(view["x"], width - 1), min(view["y"], height - 1)
        w, h = min(view["w"] or width, width - x), min(view["h"] or height, height - y)
        key = (left + x, top + y, w, h, view["bin"], view["reduce"])
        if key not in self.cache:
            self.cache[key] = reduced(self.pixels, *key).tobytes()
        if frame not in self.kept:
            self.kept[frame] = reduced(self.pixels, left, top, width, height, 1, "max"), width, height
        jpeg = self.jpeg if view["enc"] == "auto" else None
        edge = 1_795_000_000_000_000_000 + frame * 200_000_000
        head = struct.pack("<4sHHIIQQqHHHHHBBBBHIHHQq", b"OBSV", 1, 80, 0, 0, frame, frame, edge, x, y, w, h, view["bin"],
                           int(view["reduce"] == "mean"), int(jpeg is not None), BITS, 0, height, skipped, width, height, FIRST_ID + frame, edge + AGE_NS)
        return head + (jpeg or self.cache[key])


if __name__ == "__main__":
    print(PageDouble(sys.argv[1], port=int(sys.argv[2]) if len(sys.argv) > 2 else 0).link, flush=True)
    threading.Event().wait()
