# SPDX-License-Identifier: Apache-2.0
# Runs in the virtual machine as a service of the booted system. Exit status 0 only if every check passed.
# Processor emulation: floating point is up to a hundred times slower here, so the frames are small, and times are figures,
# not promises (tests/integration/service_test.py takes them on the machine itself).
set -uo pipefail
failed=0
kills=$(cat /out/kills)
ok() { echo "ok - [$(cut -d' ' -f1 /proc/uptime)] $1"; }
bad() {
    echo "NOT OK - [$(cut -d' ' -f1 /proc/uptime)] $1"
    failed=1
}
now_ms() { echo $(($(date +%s%N) / 1000000)); }
property() { systemctl show -P "$1" "${2:-obscurad}"; }
frames=/var/lib/obscura/frames
frame_count() { find $frames -name '*.raw' 2>/dev/null | wc -l; }
# wait_for SECONDS COMMAND...
wait_for() {
    local until=$(($(now_ms) + $1 * 1000))
    shift
    until "$@" >/dev/null 2>&1; do
        [ "$(now_ms)" -lt $until ] || return 1
        sleep 0.02
    done
}
configure() { # RATE EXPOSURE_US [MORE]
    cat >/etc/obscura/obscurad.toml <<END
[scene]
file = "/etc/obscura/scene.toml"
[daemon]
realtime = "required"
[render]
samples_per_pixel = 1
threads = 1
[trigger]
rate_hz = $1
over_trigger = "latch"
[camera]
exposure_us = $2
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "$frames"
[sensor.readout]
width = 64
height = 48
${3:-}
END
}

wait_for 120 systemctl is-active obscurad
[ "$(property ActiveState)" = active ] && ok "the service is active after boot, with the shipped configuration" ||
    { bad "the service is $(property ActiveState)"; systemctl status obscurad --no-pager; }
# answered_by USER: whether the monitor socket of the service answers that user.
answered_by() { runuser -u "$1" -- obscura status --json 2>/dev/null | grep "\"pid\":$(property MainPID)," >/dev/null; }
wait_for 60 answered_by obscura && ok "obscura status answers the service's user" || bad "obscura status answers nothing"
answered_by nobody && bad "obscura status answers an account outside of the group" ||
    ok "obscura status answers no account outside of the group"

cat >/etc/obscura/scene.toml <<END
[sun]
direction = [-1, -1, 0.3]
distance_au = 2
[camera]
focal_length_mm = 50
aperture_mm = 25
position_m = [-20000, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
[[body]]
shape = "ellipsoid"
radii_m = [500, 400, 300]
albedo = 0.1
END
configure 5 2000
systemctl restart obscurad && ok "restarted with small frames, real time required" || { bad "restart"; journalctl -u obscurad --no-pager | tail -n 5; }
pid=$(property MainPID)
some_frames() { [ "$(frame_count)" -ge 3 ]; }
wait_for 30 some_frames && ok "frames are stored" || bad "no frames"

# Rights
status=$(cat "/proc/$pid/status")
grep -q '^CapEff:[[:space:]]*0000000000000000' <<<"$status" && grep -q '^CapBnd:[[:space:]]*0000000000000000' <<<"$status" &&
    ok "no capability" || bad "capabilities: $(grep Cap <<<"$status")"
grep -q '^Seccomp:[[:space:]]*2' <<<"$status" && grep -q '^NoNewPrivs:[[:space:]]*1' <<<"$status" && ok "system calls are filtered" || bad "no filter"
[ "$(awk '/^VmLck/{print $2}' <<<"$status")" -gt 1000 ] && ok "memory is locked" || bad "$(grep VmLck <<<"$status")"
fifo=$(for t in /proc/"$pid"/task/*; do echo "$(cat "$t/comm"):$(chrt -p "$(basename "$t")" | sed -n 's/.*policy: //p')"; done | grep -c SCHED_FIFO)
[ "$fifo" -ge 2 ] && ok "$fifo threads under SCHED_FIFO" || bad "$fifo threads under SCHED_FIFO"
nsenter -t "$pid" -m touch /etc/obscura/written 2>/dev/null && bad "the service can write to /etc" || ok "the system is read-only to the service"

# Devices
modprobe -q configfs
if insmod /out/gpio-sim.ko 2>/dev/null; then
    c=/sys/kernel/config/gpio-sim/rig
    mkdir -p $c/bank0 && echo 4 >$c/bank0/num_lines && echo 1 >$c/live
    udevadm settle
    node=/dev/$(cat $c/bank0/chip_name)
    [ "$(stat -c '%G %a' "$node")" = "obscura 660" ] && ok "GPIO chip belongs to group obscura" || bad "GPIO chip: $(stat -c '%G %a' "$node")"
fi
modprobe -q videodev
if insmod /out/v4l2loopback.ko max_buffers=8 card_label=Obscura-0 2>/dev/null; then
    udevadm settle
    [ -c /dev/obscura/Obscura-0 ] && ok "video node has its name" || bad "no /dev/obscura/Obscura-0"
    [ "$(stat -Lc '%G' /dev/obscura/Obscura-0)" = video ] && ok "video node belongs to group video" || bad "video node: $(ls -l /dev/video*)"
fi
[ "$(sysctl -n net.core.wmem_max)" = 33554432 ] && ok "socket buffers" || bad "net.core.wmem_max = $(sysctl -n net.core.wmem_max)"

# Reload under load: every good file changes scene and late policy, every second file is bad
reloads=0 begin=$(property MainPID)
rm -rf "${frames:?}"/* # those of the runs before
for i in $(seq 10); do
    sed -i "s/^albedo = .*/albedo = 0.$((10 + i))/" /etc/obscura/scene.toml
    if [ $((i % 2)) = 0 ]; then configure 5 2000 '[deadline]
policy = "late"
grace_us = '$((100 * i)); else configure 5 2000 "[nonsense]"; fi
    systemctl reload obscurad && reloads=$((reloads + 1))
    sleep 1
done
[ "$reloads" = 10 ] && [ "$(property MainPID)" = "$begin" ] && ok "10 reloads, good and bad files in turn: the daemon lives on" || bad "$reloads reloads"
told() { journalctl -u obscurad --no-pager -o cat OBSCURA_PART=SIGHUP | grep -c "$1"; }
wait_for 30 eval '[ "$(told "taken on")" -ge 5 ]'
[ "$(told nonsense)" = 5 ] && [ "$(told 'taken on')" = 5 ] && ok "each good file was taken on, each bad one refused in the journal" ||
    { bad "$(told nonsense) refused, $(told 'taken on') taken on"; journalctl -u obscurad --no-pager -o cat OBSCURA_PART=SIGHUP | tail -n 10; }
said=$(python3 - $frames <<'END'
import pathlib, re, sys
ids = []
for told in sorted(pathlib.Path(sys.argv[1]).glob("frame_*.toml")):
    found = re.search(r"^TRIGID *= *(\d+)\b.*\n", told.read_text(), re.M)
    if found:
        ids.append(int(found[1]))
lost = [b for a, b in zip(ids, ids[1:]) if b != a + 1]
print(f"{len(ids)} frames, triggers {ids[0]} to {ids[-1]}, gaps before {lost}")
sys.exit(bool(lost) or len(ids) < 20)
END
) && ok "no frame was lost meanwhile: $said" || bad "frames were lost meanwhile: $said"
configure 5 2000

# A hung worker, whichever it is. One that writes a file may be silent for a minute, so that a slow disk is no hung thread.
silence=60 watchdog=5
worst=0 hung=0
for name in $(for t in /proc/"$(property MainPID)"/task/*; do cat "$t/comm"; done | grep -v '^obscurad$' | sort -u); do
    pid=$(property MainPID)
    systemctl reset-failed obscurad
    python3 /out/hang_thread.py "$pid" "$name" 300 >/out/hang.log 2>&1 &
    wait_for 60 grep -q 'stands still' /out/hang.log
    if [ "$name" = watch ]; then # it copies frames for viewers, whom the camera does not wait for
        touch /run/hung
        sleep $((2 * watchdog))
        if [ "$(property MainPID)" = "$pid" ] && find "$frames" -name 'frame_*' -newer /run/hung | grep . >/dev/null; then
            ok "thread 'watch' hung: the camera goes on"
        else
            bad "thread 'watch' hung: no frame came ($(cat /out/hang.log)), $(property SubState)"
        fi
        kill %% 2>/dev/null
        wait
        continue
    fi
    begin=$(now_ms)
    gone() { [ ! -e "/proc/$pid/exe" ] || [ "$(property MainPID)" != "$pid" ]; }
    serves() { [ "$(property MainPID)" != "$pid" ] && [ "$(property ActiveState)" = active ]; }
    if wait_for $((silence + 4 * watchdog)) gone && took=$(($(now_ms) - begin)) && wait_for 120 serves; then
        hung=$((hung + 1))
        [ $took -gt $worst ] && worst=$took
        ok "thread '$name' hung: ended after $took ms, a new daemon serves after $(($(now_ms) - begin)) ms (WatchdogSec 5 s)"
    else
        bad "thread '$name' hung: not restarted ($(cat /out/hang.log)), $(property SubState)"
        journalctl -u obscurad --no-pager -n 6 -o short-monotonic | sed 's/^/    /'
        kill %% 2>/dev/null
    fi
    wait
done
journalctl -u obscurad --no-pager -o cat OBSCURA_PART=watchdog | grep 'no heartbeat from' >/dev/null && ok "the journal names who hung" || bad "no word of who hung"
echo "figure - $hung kinds of threads hung, ended after $worst ms at worst"

# SIGKILL
times=()
for i in $(seq "$kills"); do
    sleep "0.$((RANDOM % 10))"
    pid=$(property MainPID)
    systemctl kill -s KILL obscurad
    begin=$(now_ms)
    rm -rf "${frames:?}"/*
    one_frame() { [ "$(frame_count)" -ge 1 ] && [ "$(property MainPID)" != "$pid" ]; }
    wait_for 120 one_frame || { bad "kill $i: no frame within 120 s"; break; }
    times+=($(($(now_ms) - begin)))
done
sorted=$(printf '%s\n' "${times[@]}" | sort -n)
worst=$(tail -1 <<<"$sorted") median=$(sed -n "$(((${#times[@]} + 1) / 2))p" <<<"$sorted")
[ ${#times[@]} = "$kills" ] && ok "$kills SIGKILLs, each time back with a frame" || bad "${#times[@]} of $kills SIGKILLs survived"
echo "figure - SIGKILL to first frame: median $median ms, worst $worst ms"
journalctl --no-pager -b >/out/journal

# A bad configuration is final
configure 5 2000 "[nonsense]"
systemctl restart obscurad 2>/dev/null
sleep 2
[ "$(property ActiveState)" = failed ] && [ "$(property ExecMainStatus)" = 78 ] && ok "a bad configuration ends it, status 78" ||
    bad "after a bad configuration: $(property ActiveState), $(property ExecMainStatus)"
before=$(property NRestarts)
sleep 2
[ "$(property NRestarts)" = "$before" ] && ok "and is not tried again" || bad "tried again: $(property NRestarts)"

# Another camera
configure 5 2000
sed -i 's|^directory.*|directory = "/var/lib/obscura-north"|' /etc/obscura/obscurad.toml
mv /etc/obscura/obscurad.toml /etc/obscura/north.toml
systemctl start obscurad@north && sleep 2 && [ "$(find /var/lib/obscura-north -name '*.raw' | wc -l)" -ge 1 ] && ok "instance 'north' stores frames in its own folder" ||
    { bad "instance 'north'"; journalctl -u obscurad@north --no-pager | tail -n 5; }
begin=$(now_ms)
systemctl stop obscurad@north
[ $(($(now_ms) - begin)) -lt 3000 ] && ok "stops in $(($(now_ms) - begin)) ms" || bad "stops in $(($(now_ms) - begin)) ms"
exit $failed
