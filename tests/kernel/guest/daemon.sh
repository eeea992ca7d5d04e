# SPDX-License-Identifier: Apache-2.0
# For checks with the real daemon: daemon_start WIDTH HEIGHT TOML [ADC-BITS [OPTION...]], daemon_stop, daemon_counters TRANSPORT,
# daemon_undisturbed TRANSPORT (none was dropped while it ran). Frames are also
# written to ./frames as raw files, in memory. The scene is light: floating-point arithmetic is slow in the emulated machine.
# daemon_run [OPTION...] starts it with a daemon.toml, and a scene, of the check's own.
need "$RIG_BUILD/emulator/obscurad"
daemon_run() {
    rm -rf frames ready "/run/frames/$PWD"
    mkdir -p "/run/frames/$PWD"
    ln -sfn "/run/frames/$PWD" frames
    obscurad --config daemon.toml --ready-file ready --stats stats.json "$@" >daemon.log 2>&1 &
    daemon=$!
    wait_for 60 test -s ready || fail "the daemon is not ready: $(cat daemon.log)"
}
daemon_start() {
    cat >scene.toml <<END
name = "light"
[sun]
direction = [-1, -1, 0.3]
distance_au = 2
[camera]
focal_length_mm = 50
aperture_mm = 25
psf_sigma_px = 0
position_m = [-20000, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
[[body]]
name = "moonlet"
shape = "ellipsoid"
radii_m = [200, 160, 120]
material = "lommel-seeliger"
albedo = 0.1
spin_axis = [0.0, 0.2, 1.0]
spin_rate_deg_per_s = 30
END
    cat >daemon.toml <<END
[scene]
file = "scene.toml"
[daemon]
seed = 5
pool_frames = 24
realtime = "off"
autostart = true
[render]
samples_per_pixel = 1
max_instants = 1
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "frames"
queue_frames = 8
[sensor.readout]
width = $1
height = $2
[sensor.detector]
adc_bits = ${4:-12}
$3
END
    daemon_run "${@:5}"
}
daemon_stop() {
    kill -TERM "$daemon"
    wait "$daemon" || fail "the daemon ended with status $?: $(cat daemon.log)"
}
daemon_counters() {
    python3 -c 'import json, sys; print(sys.argv[1] + ": " + json.dumps(json.load(open("stats.json"))["transports"][sys.argv[1]]))' "$1"
}
daemon_undisturbed() {
    local said
    said=$(python3 - "$1" <<'END'
import json, os, sys
told = json.load(open("stats.json"))
transport = told["transports"][sys.argv[1]]
camera = {key: told["camera"][key] for key in ("triggers", "frames", "missed_triggers", "dropped")}
print(f"{camera}, {transport['delivered']} of {transport['submitted']} delivered")
# What waits in its queue when the daemon is told to end is given up after a moment.
# On a busy machine the emulated one may be too slow for the frames as such.
sys.exit(transport["dropped"] > 8 and not os.environ.get("RIG_BUSY"))
END
    ) || fail "$1 was disturbed: $said"
    figure "$1 beside it: $said"
}
