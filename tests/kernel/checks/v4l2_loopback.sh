# V4L2 transport to v4l2loopback of Debian 12 and 13: v4l2-ctl, ffmpeg and GStreamer get every pixel, stamps are edges
# time limit: 120 s
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
with_v4l2_ctl() { # FORMAT BITS [stamps]
    # It prints no time stamps of this kind, only that they are the producer's.
    v4l2-ctl -d /dev/video10 --stream-mmap=32 --stream-count=8 --stream-to=v4l2-ctl.raw --verbose >v4l2-ctl.log 2>&1
    [ -z "${3:-}" ] || [ "$(grep -c 'dqbuf.*ts-copy' v4l2-ctl.log)" -ge 8 ] || fail "time stamps are not the producer's"
    check v4l2-ctl.raw "$1" "$2" 8
}
with_ffmpeg() { # FORMAT BITS [stamps]
    local pixels=gray16le
    [ "$1" = GREY ] && pixels=gray
    ffmpeg -nostdin -hide_banner -f v4l2 -input_format $pixels -video_size 320x240 -ts default -copyts -i /dev/video10 \
        -frames:v 10 -vf showinfo -fps_mode passthrough -f rawvideo -pix_fmt $pixels -y ffmpeg.raw >ffmpeg.log 2>&1 ||
        fail "ffmpeg: $(tail -n 5 ffmpeg.log)"
    if [ "${3:-}" = stamps ]; then
        sed -n 's/.*showinfo.* pts: *\([0-9]*\) .*/\1/p' ffmpeg.log >stamps
        check ffmpeg.raw "$1" "$2" 10 --stamps stamps --edges edges
    else
        check ffmpeg.raw "$1" "$2" 10
    fi
}
with_gstreamer() { # FORMAT BITS
    local pixels=GRAY16_LE
    [ "$1" = GREY ] && pixels=GRAY8
    # The driver of Debian 12 now and then gives a reader that starts up an error; only that is tried again.
    local attempts=1
    [ -n "$flavour" ] || attempts=3
    until gst-launch-1.0 -q v4l2src device=/dev/video10 num-buffers=5 ! "video/x-raw,format=$pixels,width=320,height=240" ! \
        filesink location=gstreamer.raw >gstreamer.log 2>&1; do
        attempts=$((attempts - 1))
        [ $attempts -gt 0 ] || fail "gstreamer: $(tail -n 5 gstreamer.log)"
    done
    check gstreamer.raw "$1" "$2" 5
}

for flavour in "" newer; do
    stamps=''
    [ "$flavour" = newer ] && stamps=stamps
    loopback_up $flavour
    say "v4l2loopback $(modinfo -F version "$RIG_MODULES/${flavour:+newer/}v4l2loopback.ko")"
    stream Y16 12
    with_ffmpeg Y16 12 $stamps
    with_v4l2_ctl Y16 12 $stamps
    with_gstreamer Y16 12
    stop_stream
    loopback_up $flavour
    stream GREY 12
    with_ffmpeg GREY 12 $stamps
    with_v4l2_ctl GREY 12 $stamps
    with_gstreamer GREY 12
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
