# SPDX-License-Identifier: Apache-2.0
# V4L2 transport to vivid, a driver that enforces every rule of the interface: Y12, Y16 and GREY by mmap
# lane: screen
# time limit: 240 s
# Its write() does not work for any program in Linux 6.1 (dd gets EINVAL too), so only mmap is tried.
vivid_up
flow() { # FORMAT BITS OPTION...
    local format=$1 bits=$2
    shift 2
    v4l2_stream --device /dev/video21 --size 640x480 --format "$format" --bits "$bits" --rate 20 "$@" >stream.log 2>&1 &
    local producer=$! said
    wait_for 10 grep -q . edges || fail "no stream: $(cat stream.log)"
    sleep 0.3
    v4l2-ctl -d /dev/video20 --set-fmt-video="width=640,height=480,pixelformat=$(printf '%-4s' "$format")" \
        --stream-mmap=4 --stream-skip=6 --stream-count=10 --stream-to=vivid.raw >v4l2-ctl.log 2>&1
    said=$(image_check vivid.raw --size 640x480 --format "$format" --bits "$bits" --count 10 --repeats yes 2>&1) ||
        fail "$format $*: $said"
    say "$format $*: $said"
    kill -TERM $producer
    wait $producer || fail "producer: $(cat stream.log)"
    cat stream.log counters
    grep -q ' lost=0 refused=0 ' counters || fail "the node was lost: $(cat counters)"
    rm -f edges counters vivid.raw
}
flow Y16 14
flow Y12 12
flow GREY 12
