# SPDX-License-Identifier: Apache-2.0
# V4L2 transport to v4l2loopback of Debian 12 and 13: v4l2-ctl, ffmpeg and GStreamer get every pixel, stamps are edges
# lane: video
# time limit: 300 s
. "$RIG/guest/video.sh"
stream() { # FORMAT BITS [OPTION...]
    local format=$1 bits=$2
    shift 2
    v4l2_stream --device /dev/video10 --format "$format" --bits "$bits" --rate 10 "$@" >stream.log 2>&1 &
    producer=$!
    wait_for 10 grep -q "$format 320x240" stream.log || fail "no stream: $(cat stream.log)"
    wait_for 5 grep -q . edges
}
stop_stream() {
    kill -TERM $producer
    wait $producer || fail "producer: $(cat stream.log)"
    cat stream.log counters
    grep -q ' dropped=0 .* lost=0 .*in_use=0' counters || fail "frames were lost: $(cat counters)"
    rm -f edges counters
}
check() { # FILE FORMAT BITS COUNT [OPTION...]
    local file=$1 format=$2 bits=$3 count=$4
    shift 4
    local said
    # The driver of Debian 12 may hand a new reader the same image twice.
    [ -n "$flavour" ] || set -- "$@" --repeats yes
    said=$(image_check "$file" --size 320x240 --format "$format" --bits "$bits" --count "$count" "$@" 2>&1) ||
        fail "$file: $said"
    say "$file: $said"
    rm -f "$file"
}
look() { # FORMAT BITS
    local tool
    for tool in ffmpeg v4l2-ctl gstreamer; do
        # The slowest of them sees every driver and every format, but not every pair.
        [ "$1$flavour$tool" = GREYffmpeg ] && continue
        take_with $tool 320x240 "$1" 5
        if [ "$flavour" = newer ] && [ $tool = ffmpeg ]; then
            check $tool.raw "$1" "$2" 5 --stamps stamps --edges edges
        else
            check $tool.raw "$1" "$2" 5
        fi
    done
    # It prints no time stamps of this kind, only that they are the producer's.
    [ -z "$flavour" ] || [ "$(grep -c 'dqbuf.*ts-copy' v4l2-ctl.log)" -ge 5 ] || fail "time stamps are not the producer's"
}

for flavour in "" newer; do
    # With exclusive_caps the node is an output until a program feeds it and a camera from then on, as browsers want it; it
    # has to become an output again when the feeding ends.
    loopback_up $flavour exclusive_caps=1
    say "v4l2loopback $(modinfo -F version "$RIG_MODULES/${flavour:+newer/}v4l2loopback.ko")"
    stream Y16 12
    look Y16 12
    stop_stream
    stream GREY 12
    look GREY 12
    stop_stream
done

# Formats whose rows these drivers count in packed bits are refused, in one line.
loopback_up
v4l2_stream --required yes --format Y10 --frames 1 >refused 2>&1 && fail "Y10 was accepted: $(cat refused)"
say "$(cat refused)"
grep -q '^v4l2: /dev/video10: the driver counts 400 bytes a row for Y10 320x240, 640 are needed$' refused
# So is a node whose format another program holds.
v4l2_stream --format Y16 --size 640x480 --frames 1000 >holder.log 2>&1 &
holder=$!
wait_for 10 grep -q "640x480" holder.log
v4l2_stream --required yes --format Y16 --frames 1 >refused 2>&1 && fail "a held format was accepted: $(cat refused)"
say "$(cat refused)"
kill -TERM $holder
wait $holder
