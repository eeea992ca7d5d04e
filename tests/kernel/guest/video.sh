# SPDX-License-Identifier: Apache-2.0
# For checks that read a video node with other people's programs: take_with TOOL SIZE FORMAT COUNT saves COUNT images of
# /dev/video10 to TOOL.raw (FORMAT GREY or Y16; TOOL v4l2-ctl, ffmpeg or gstreamer). ffmpeg also tells their time stamps
# as the driver gave them, in microseconds, in the file `stamps`.
take_with() {
    local tool=$1 size=$2 format=$3 count=$4 attempt
    # A loopback driver may refuse a reader that starts up, or hand it a buffer that it has already. Readers report that
    # and can be started again; wrong pixels are never tried again.
    for attempt in 1 2 3; do
        "take_with_$tool" "$size" "$format" "$count" >"$tool.log" 2>&1 && return 0
        say "$tool, attempt $attempt: $(grep -iE -m 1 'error|fail|invalid' "$tool.log" || tail -n 1 "$tool.log")"
    done
    fail "$tool: $(tail -n 5 "$tool.log")"
}
take_with_v4l2-ctl() {
    v4l2-ctl -d /dev/video10 --stream-mmap=32 --stream-count="$3" --stream-to=v4l2-ctl.raw --verbose &&
        [ "$(stat -c %s v4l2-ctl.raw)" -gt 0 ]
}
take_with_ffmpeg() {
    local pixels=gray16le
    [ "$2" = GREY ] && pixels=gray
    ffmpeg -nostdin -hide_banner -f v4l2 -input_format $pixels -video_size "$1" -ts default -copyts -i /dev/video10 \
        -frames:v "$3" -vf showinfo -fps_mode passthrough -f rawvideo -pix_fmt $pixels -y ffmpeg.raw || return 1
    sed -n 's/.*showinfo.* pts: *\([0-9]*\) .*/\1/p' ffmpeg.log >stamps
}
take_with_gstreamer() {
    local pixels=GRAY16_LE
    [ "$2" = GREY ] && pixels=GRAY8
    gst-launch-1.0 -q v4l2src device=/dev/video10 num-buffers="$3" ! \
        "video/x-raw,format=$pixels,width=${1%x*},height=${1#*x}" ! filesink location=gstreamer.raw
}
