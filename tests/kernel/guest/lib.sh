# SPDX-License-Identifier: Apache-2.0
# What every check may use; read before the check. A check is a bash script that runs as root in a folder of its own
# under /out: it exits 0 when everything is as it must be. Set: RIG (this folder's parent), RIG_BUILD (CMake's build
# folder), RIG_MODULES (modules that Debian's kernel lacks).
set -euo pipefail
PATH=$RIG_BUILD/tests/kernel/programs:$RIG_BUILD/emulator:$RIG_BUILD/tools:$PATH
export PATH GST_REGISTRY=$RIG_GST_REGISTRY GST_REGISTRY_UPDATE=no

# What a check leaves running would hold devices that the next one needs.
trap 'kill $(jobs -p) 2>/dev/null || true; wait' EXIT

say() { echo "[$(cut -d' ' -f1 /proc/uptime)] $*"; }
# A measured value for the summary.
figure() { echo "FIGURE: $*"; }
fail() { say "FAILED: $*"; exit 1; }
skip() { echo "SKIP: $*"; exit 77; }
need() { for f in "$@"; do [ -e "$f" ] || skip "$f is not there"; done; }

# load MODULE [PARAMETER...]: Debian's module or, where it has none, the rig's. With parameters it is loaded afresh.
load() {
    local module=$1
    shift
    if [ $# -gt 0 ] && grep -q "^$(tr - _ <<<"$module") " /proc/modules; then rmmod "$module"; fi
    if [ -f "$RIG_MODULES/$module.ko" ]; then
        for dependency in $(modinfo -F depends "$RIG_MODULES/$module.ko" | tr , ' '); do modprobe "$dependency"; done
        # A check beside this one may be loading it as well.
        insmod "$RIG_MODULES/$module.ko" "$@" 2>/dev/null || wait_for 5 grep -q "^$(tr - _ <<<"$module") .* Live " /proc/modules
    else
        modprobe "$module" "$@"
    fi
}

# wait_for SECONDS COMMAND...: until the command succeeds.
wait_for() {
    local until=$(($(date +%s%N) + $1 * 1000000000))
    shift
    until "$@" 2>/dev/null; do
        [ "$(date +%s%N)" -lt $until ] || return 1
        sleep 0.05
    done
}

# gpio_up LABEL LINES [NAMED-LINE=NAME...]: a simulated GPIO chip. Sets GPIO_CHIP (gpiochipN) and GPIO_LINES, in whose
# folders sim_gpioN/pull is set from outside (pull-up, pull-down) and sim_gpioN/value reads an output.
gpio_up() {
    load gpio-sim
    local label=$1 lines=$2 chip=/sys/kernel/config/gpio-sim/$1
    shift 2
    mkdir -p "$chip/bank0"
    echo "$lines" >"$chip/bank0/num_lines"
    echo "$label" >"$chip/bank0/label"
    for line in "$@"; do
        mkdir -p "$chip/bank0/line${line%%=*}"
        echo "${line#*=}" >"$chip/bank0/line${line%%=*}/name"
    done
    echo 1 >"$chip/live"
    gpio_lines "$label"
}
# gpio_lines LABEL: sets them again, for a chip that was away.
gpio_lines() {
    local chip=/sys/kernel/config/gpio-sim/$1
    GPIO_CHIP=$(cat "$chip/bank0/chip_name")
    GPIO_LINES=/sys/devices/platform/$(cat "$chip/dev_name")/$GPIO_CHIP
}
gpio_down() {
    local chip=/sys/kernel/config/gpio-sim/$1
    echo 0 >"$chip/live"
    rmdir "$chip"/bank0/line* 2>/dev/null || true
    rmdir "$chip/bank0" "$chip"
}

# loopback_up [newer] [PARAMETER...]: v4l2loopback with /dev/video10. `newer` is Debian 13's.
# Thirty-two buffers, because an image is overwritten one turn later whether or not it was read, and readers take seconds
# to start up in the emulated machine.
loopback_up() {
    load videodev
    grep -q '^v4l2loopback ' /proc/modules && rmmod v4l2loopback
    if [ "${1:-}" = newer ]; then
        shift
        need "$RIG_MODULES/newer/v4l2loopback.ko"
        insmod "$RIG_MODULES/newer/v4l2loopback.ko" devices=1 video_nr=10 max_buffers=32 exclusive_caps=0 "$@"
    else
        insmod "$RIG_MODULES/v4l2loopback.ko" devices=1 video_nr=10 max_buffers=32 exclusive_caps=0 "$@"
    fi
    wait_for 5 test -c /dev/video10
}

# vivid_up: the kernel's strict video test driver: what is written to /dev/video21 comes out of /dev/video20, 640x480.
vivid_up() {
    load vivid n_devs=1 node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 output_types=1 vid_cap_nr=20 vid_out_nr=21
    wait_for 5 test -c /dev/video21
    # Kernels from 6.12 on connect the two by a menu control instead.
    v4l2-ctl -d /dev/video20 -c loop_video=1 2>/dev/null || v4l2-ctl -d /dev/video20 -c hdmi_000_0_is_connected_to=1
    v4l2-ctl -d /dev/video20 -c osd_text_mode=2
    for node in 20 21; do v4l2-ctl -d /dev/video$node --set-dv-bt-timings index=0 >/dev/null; done
}
