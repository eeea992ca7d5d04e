#include "emulator/config/daemon_keys.hpp"

#include "renderer/scene_files/scene_file.hpp"
#include "sensors/sensor_file.hpp"

namespace obscura::emulator {
config::Keys keys_of(DaemonSection& s) {
    return {
        config::key("log_level", &s.log_level)
            .choices({"error", "warning", "notice", "info", "debug"})
            .help("Least important lines that are logged"),
        config::key("realtime", &s.realtime)
            .choices({"off", "auto", "required"})
            .help("SCHED_FIFO and locked memory: never, where permitted, or refuse to start without"),
        config::key("pool_frames", &s.pool_frames).range(3, 256).help("Frames allocated at start"),
        config::key("seed", &s.seed).range(0, 9e15).help("Same seed and trigger: same bytes"),
        config::key("scene_time", &s.scene_time)
            .choices({"nominal", "clock"})
            .help("nominal: frame k shows the scene k - 1 nominal periods after its start, so that it can be "
                  "made again offline; clock: as much later as really passed"),
        config::key("drop_capabilities", &s.drop_capabilities)
            .help("Give up the powers of root before anything listens; false where folders of other users "
                  "are to be written or ports below 1024 are listened at"),
        config::key("autostart", &s.autostart)
            .help("Acquire from the start on; always so when no control port is enabled"),
    };
}

config::Keys keys_of(RenderSection& s) {
    return {
        config::key("samples_per_pixel", &s.samples_per_pixel)
            .range(1, 65536)
            .help("Rays per pixel that a body may cover"),
        config::key("target_error", &s.target_error)
            .range(0, 1)
            .help("Take more samples until a pixel's relative standard error is about this; 0: "
                  "samples_per_pixel everywhere"),
        config::key("max_samples_per_pixel", &s.max_samples_per_pixel)
            .range(1, 65536)
            .help("Limit that goes with target_error"),
        config::key("max_instants", &s.max_instants)
            .range(1, 4096)
            .help("Instants that an exposure is made of, at most, where something moves in it; 1: all is "
                  "seen at its middle"),
        config::key("threads", &s.threads).range(0, 1024).help("Render threads; 0: one per core"),
        config::key("band_rows", &s.band_rows)
            .range(1, 16384)
            .help("Rows rendered, exposed and sent together"),
    };
}

config::Keys keys_of(LineSection& s) {
    return {
        config::key("source", &s.source)
            .choices({"timer", "ptp_timer", "gpio", "pps", "ptp", "udp", "none"})
            .help("What is wired to this line of the camera: a source as in [trigger], or nothing"),
        config::key("rate_hz", &s.rate_hz)
            .unit("Hz")
            .range(0.001, 10000)
            .help("Rate of timer, ptp_timer and pps; for other sources the nominal rate that scene_time "
                  "counts in"),
        config::key("phase_ms", &s.phase_ms)
            .unit("ms")
            .range(0, 1e6)
            .help("timer, ptp_timer and pps: shift of the edges"),
        config::key("line", &s.line).help("gpio: name of the line, or \"gpiochipN:OFFSET\""),
        config::key("edge", &s.edge).choices({"rising", "falling", "both"}).help("gpio: which edges count"),
        config::key("device", &s.device)
            .help("pps, ptp and ptp_timer: device node; empty: /dev/pps0 or /dev/ptp0"),
        config::key("channel", &s.channel).range(0, 64).help("ptp: input of the clock"),
        config::key("start", &s.start)
            .help("ptp_timer: the first edge, in seconds of that clock (TAI since 1970), like "
                  "\"1795244437.5\"; empty: its next full second"),
        config::key("listen", &s.listen).help("udp: address and port that triggers are sent to"),
        config::key("debounce_us", &s.debounce_us)
            .unit("us")
            .range(0, 1e6)
            .help("An edge sooner than this after another is a bounce"),
        config::key("divider", &s.divider)
            .range(1, 1000000)
            .help("The first of every so many edges is a trigger"),
        config::key("delay_us", &s.delay_us)
            .unit("us")
            .range(0, 1e7)
            .help("From the edge to the start of the exposure"),
    };
}

config::Keys keys_of(TriggerSection& s) {
    config::Keys keys = keys_of(static_cast<LineSection&>(s));
    keys.front() =
        config::key("source", &s.source)
            .choices({"timer", "ptp_timer", "gpio", "pps", "ptp", "udp", "lockstep", "none"})
            .help("What drives Line0: a timer on an absolute schedule, the same in the time of a PTP clock, "
                  "edges of a GPIO line, instants in step with a pulse per second, edges on a PTP clock's "
                  "input, UDP datagrams, steps of a simulator, or nothing (software triggers only)");
    keys.push_back(config::key("over_trigger", &s.over_trigger)
                       .choices({"count", "ignore", "latch"})
                       .help("An edge before the camera is ready again is missed, of no interest, or (the "
                             "first one) kept until it is"));
    return keys;
}

config::Keys keys_of(PtpSection& s) {
    return {
        config::key("enabled", &s.enabled)
            .help("Ask ptp4l how its clock is doing: shown as Ptp* features, and time stamps are TAI once it "
                  "is locked"),
        config::key("socket", &s.socket).help("Its management socket (uds_address)"),
        config::key("domain", &s.domain).range(0, 127).help("Its domain (domainNumber)"),
        config::key("lock_us", &s.lock_us)
            .unit("us")
            .range(0.001, 1e6)
            .help("The clock of a slave counts as locked while its offset from the master is not above this"),
    };
}

config::Keys keys_of(DeadlineSection& s) {
    return {
        config::key("policy", &s.policy)
            .choices({"late", "repeat", "drop", "partial"})
            .help("A frame with a row that is not ready in time: leaves late, shows the frame before, is "
                  "given up, or ends there"),
        config::key("grace_us", &s.grace_us)
            .unit("us")
            .range(0, 1e7)
            .help("How long after a row's time the policy applies (not late)"),
        config::key("spin_us", &s.spin_us)
            .unit("us")
            .range(0, 1000)
            .help("Poll the clock for the last so much before a frame's first row; only under SCHED_FIFO"),
    };
}

config::Keys keys_of(SimulatorSection& s) {
    return {
        config::key("enabled", &s.enabled).help("Let another program say where things are, and make steps"),
        config::key("listen", &s.listen).help("Address and port: TCP for commands, UDP for poses"),
        config::key("max_extrapolation_ms", &s.max_extrapolation_ms)
            .unit("ms")
            .range(0, 1e6)
            .help("How long a motion goes on past its last pose; after that it holds"),
    };
}

config::Keys keys_of(OutputsSection& s) {
    return {
        config::key("trigger_ready", &s.trigger_ready)
            .help("GPIO line that is active while a trigger would be taken, by name or \"gpiochipN:OFFSET\"; "
                  "empty: none"),
        config::key("exposure", &s.exposure)
            .help(
                "GPIO line that is active from the first row's reset to the last row's readout; empty: none"),
        config::key("active_low", &s.active_low).help("Active means a low level"),
    };
}

config::Keys keys_of(ThreadsSection& s) {
    const config::Range fifo{0, 98};
    return {
        config::key("trigger_priority", &s.trigger_priority)
            .range(fifo)
            .help("SCHED_FIFO priority of what waits for edges"),
        config::key("release_priority", &s.release_priority)
            .range(fifo)
            .help("Of what lets rows out at their times"),
        config::key("transmit_priority", &s.transmit_priority)
            .range(fifo)
            .help("Of what sends GigE Vision; its control is one above"),
        config::key("detector_priority", &s.detector_priority).range(fifo).help("Of the detector"),
        config::key("pipeline_priority", &s.pipeline_priority)
            .range(fifo)
            .help("Of what takes triggers and renders along; 0: ordinary scheduling"),
        config::key("display_priority", &s.display_priority)
            .range(fifo)
            .help("Of what feeds V4L2 and the stimulator"),
        config::key("trigger_cores", &s.trigger_cores)
            .help("Cores of that thread, like \"2-3,5\"; empty: any"),
        config::key("release_cores", &s.release_cores).help("The same"),
        config::key("transmit_cores", &s.transmit_cores).help("The same"),
        config::key("detector_cores", &s.detector_cores).help("The same"),
        config::key("pipeline_cores", &s.pipeline_cores).help("The same"),
        config::key("display_cores", &s.display_cores).help("The same"),
        config::key("render_cores", &s.render_cores).help("The same, of all render threads"),
    };
}

config::Keys keys_of(CameraSection& s) {
    return {
        config::key("width", &s.width)
            .unit("px")
            .range(0, 65536)
            .help("Width after reset; 0: the whole sensor"),
        config::key("height", &s.height)
            .unit("px")
            .range(0, 65536)
            .help("Height after reset; 0: the whole sensor"),
        config::key("offset_x", &s.offset_x).unit("px").range(0, 65535).help("OffsetX after reset"),
        config::key("offset_y", &s.offset_y).unit("px").range(0, 65535).help("OffsetY after reset"),
        config::key("pixel_format", &s.pixel_format)
            .choices({"Mono8", "Mono10", "Mono12", "Mono14", "Mono16", "Mono10p", "Mono12p"})
            .help("PixelFormat after reset"),
        config::key("exposure_us", &s.exposure_us).unit("us").range(1, 1e7).help("ExposureTime after reset"),
        config::key("gain_db", &s.gain_db).unit("dB").range(0, 48).help("Gain after reset"),
        config::key("trigger_mode", &s.trigger_mode)
            .choices({"On", "Off"})
            .help("TriggerMode after reset; Off: free run"),
        config::key("trigger_source", &s.trigger_source)
            .choices({"Line0", "Line1", "Line2", "Line3", "Software", "Action1"})
            .help(
                "TriggerSource after reset; Line0 is what [trigger] drives, Line1 what [trigger.line1] does"),
        config::key("trigger_activation", &s.trigger_activation)
            .choices({"auto", "RisingEdge", "FallingEdge", "AnyEdge", "LevelHigh", "LevelLow"})
            .help("TriggerActivation after reset; auto: all edges that the line's source tells of"),
        config::key("exposure_mode", &s.exposure_mode)
            .choices({"Timed", "TriggerWidth"})
            .help("ExposureMode after reset; TriggerWidth: exposed as long as the pulse of the trigger lasts "
                  "(gpio, edge = \"both\")"),
        config::key("frame_rate_hz", &s.frame_rate_hz)
            .unit("Hz")
            .range(0.01, 1000)
            .help("AcquisitionFrameRate after reset (free run, and while a level holds)"),
        config::key("readout_timing", &s.readout_timing)
            .choices({"sensor", "fast"})
            .help("Rows leave as the chip reads them, or as soon as they are rendered; triggers and "
                  "exposures are the chip's either way"),
        config::key("rows_max", &s.rows_max)
            .unit("px")
            .range(0, 1048576)
            .help("Rows of images composed of several windows that a client may ask for; 0: what sensor and "
                  "windows need"),
    };
}

config::Keys keys_of(WindowSection& s) {
    return {
        config::key("width", &s.width).unit("px").range(1, 65536).help("Width of the window"),
        config::key("height", &s.height)
            .unit("px")
            .range(1, 65536)
            .help("Height of the window; push-broom: lines"),
        config::key("offset_x", &s.offset_x)
            .unit("px")
            .range(0, 65535)
            .help("Its first column on the sensor"),
        config::key("offset_y", &s.offset_y).unit("px").range(0, 65535).help("Its first row on the sensor"),
        config::key("exposure_us", &s.exposure_us)
            .unit("us")
            .range(1, 1e7)
            .help("Its integration time; not given: that of [camera]"),
        config::key("sampling", &s.sampling)
            .choices({"destructive", "non-destructive", "cds", "ramp"})
            .help("How it is read: sample and reset; every one of several reads without a reset; the last "
                  "less the first of them; a line fitted through them"),
        config::key("reads", &s.reads).range(1, 64).help("Reads of a window that is not read destructively"),
    };
}

config::Keys keys_of(GigeSection& s) {
    return {
        config::key("enabled", &s.enabled).help("Be a GigE Vision camera"),
        config::key("interface", &s.interface).help("Network interface, or one of its IPv4 addresses"),
        config::key("port", &s.port).range(1, 65535).help("UDP port of GVCP; clients look on 3956"),
        config::key("vendor", &s.vendor).help("DeviceVendorName, at most 31 characters"),
        config::key("model", &s.model).help("DeviceModelName, at most 31 characters"),
        config::key("serial", &s.serial).help("DeviceSerialNumber, at most 15 characters"),
        config::key("user_name", &s.user_name).help("DeviceUserID, at most 15 characters"),
        config::key("mac", &s.mac)
            .help("Hardware address to show, like \"02:4f:00:00:00:01\"; empty: the interface's own, or one "
                  "made from the address where several cameras share an interface"),
        config::key("packet_size", &s.packet_size)
            .unit("bytes")
            .range(576, 16260)
            .help("GevSCPSPacketSize after reset: IP, UDP and GVSP headers and data; not above the "
                  "interface's MTU"),
        config::key("heartbeat_timeout_ms", &s.heartbeat_timeout_ms)
            .unit("ms")
            .range(500, 600000)
            .help("GevHeartbeatTimeout after reset"),
        config::key("history_frames", &s.history_frames).range(1, 64).help("Frames kept for packet resend"),
        config::key("drop_percent", &s.drop_percent)
            .unit("%")
            .range(0, 100)
            .help("Fault: packets left out on purpose when first sent"),
        config::key("throughput_limit_mbit_s", &s.throughput_limit_mbit_s)
            .unit("Mbit/s")
            .range(0, 100000)
            .help("DeviceLinkThroughputLimit after reset: the pace of the packets; 0: none, for receivers "
                  "that keep up"),
        config::key("backend", &s.backend)
            .choices({"sendmmsg", "sendto", "gso", "auto"})
            .help("How packets reach the kernel: batches, one by one, super-packets (UDP segmentation "
                  "offload), or super-packets only towards a real network card"),
        config::key("allow", &s.allow)
            .help("Who may talk to the camera, like \"192.168.7.0/24, 192.168.8.4\"; empty: everybody on the "
                  "link"),
        config::key("off_link", &s.off_link).help("Answer sources behind a router, too"),
        config::key("read_only", &s.read_only).help("Nobody gets control; for looking at a camera only"),
        config::key("xml", config::Path{&s.xml, true, true})
            .help("GenICam file of a real camera to show in place of our own; its features are bound by SFNC "
                  "name"),
        config::key("xml_values", &s.xml_values)
            .help("With xml: what other features hold after reset, like \"HeaterSetPoint=20, "
                  "SerialText=FM-03\""),
        config::key("state_file", config::Path{&s.state_file, false, true})
            .help("Where user sets are kept; empty: in memory"),
    };
}

config::Keys keys_of(FaultSection& s) {
    return {
        config::key("kind", &s.kind)
            .choices({"lose", "lose_for_good", "duplicate", "reorder", "delay", "corrupt", "drop_leader",
                      "drop_trailer", "skip_frame", "freeze_frame", "repeat_frame", "wrong_block_id",
                      "wrong_timestamp", "mute_control", "heartbeat_loss"})
            .help(
                "What goes wrong: with payload packets, with whole frames, or with the answers to commands"),
        config::key("percent", &s.percent)
            .unit("%")
            .range(0, 100)
            .help("How many of those that the other keys let it strike"),
        config::key("first", &s.first)
            .range(1, 9e15)
            .help("First frame, counted since the client opened its stream; for mute_control and "
                  "heartbeat_loss first command, counted since the start"),
        config::key("last", &s.last).range(0, 9e15).help("Last frame or command; 0: no end"),
        config::key("every", &s.every)
            .range(1, 9e15)
            .help("Only every so many frames or commands, from the first on"),
        config::key("burst_packets", &s.burst_packets)
            .range(1, 65536)
            .help("Neighbouring packets struck together"),
        config::key("amount", &s.amount)
            .range(-1e9, 1e9)
            .help("delay, wrong_timestamp: by how many microseconds; wrong_block_id: by how much too high"),
        config::key("seed", &s.seed).range(0, 9e15).help("Of the choice by percent; 0: that of the daemon"),
    };
}

config::Keys keys_of(FileSection& s) {
    return {
        config::key("enabled", &s.enabled).help("Write every frame to a file"),
        config::key("directory", config::Path{&s.directory, false})
            .help("Folder for the files; made if need be"),
        config::key("format", &s.format).choices({"png", "fits", "raw"}).help("Kind of file"),
        config::key("queue_frames", &s.queue_frames)
            .range(1, 256)
            .help("Frames that may wait for the disk; more are dropped and counted"),
        config::key("truth", &s.truth)
            .help("Also write truth_NNNNNN.fits: electrons before noise, saturated pixels, row times, "
                  "particles"),
    };
}

config::Keys keys_of(V4l2Section& s) {
    return {
        config::key("enabled", &s.enabled).help("Feed a Linux video output node (v4l2loopback or another)"),
        config::key("device", &s.device).help("The node"),
        config::key("format", &s.format)
            .choices({"GREY", "Y10", "Y12", "Y14", "Y16"})
            .help("Pixel format; Y: digital numbers as they are, low bit first; GREY: their high 8 bits"),
        config::key("io", &s.io)
            .choices({"auto", "mmap", "write"})
            .help("Way into the driver; auto: mmap, which carries trigger time stamps, unless the driver "
                  "mixes buffers up"),
        config::key("buffers", &s.buffers).range(2, 32).help("Buffers asked of the driver for mmap"),
        config::key("queue_frames", &s.queue_frames)
            .range(1, 256)
            .help("Frames that may wait for the node; more are dropped and counted"),
        config::key("frame_counter", &s.frame_counter)
            .help("Put the frame number into the first four pixels, a byte each, lowest first"),
        config::key("required", &s.required).help("Do not start without the node; else it is waited for"),
    };
}

config::Keys keys_of(StimulatorSection& s) {
    return {
        config::key("enabled", &s.enabled)
            .help("Show every frame on a USB display (GUD) in front of a real camera"),
        config::key("vendor_id", &s.vendor_id).range(0, 65535).help("USB vendor number of the display"),
        config::key("product_id", &s.product_id).range(0, 65535).help("USB product number of the display"),
        config::key("serial", &s.serial).help("Its serial number; empty: the first display found"),
        config::key("width", &s.width)
            .unit("px")
            .range(0, 16384)
            .help("Of its mode; 0: what the display prefers"),
        config::key("height", &s.height)
            .unit("px")
            .range(0, 16384)
            .help("Of its mode; 0: what the display prefers"),
        config::key("refresh_hz", &s.refresh_hz)
            .unit("Hz")
            .range(0, 10000)
            .help("Of its mode; 0: what the display prefers"),
        config::key("format", &s.format)
            .choices({"auto", "R8", "RGB888", "XRGB8888"})
            .help("Pixels on the wire; auto: the first it takes"),
        config::key("grey", &s.grey)
            .choices({"equal", "sum", "high_low"})
            .help("What the channels of a colour format carry: all the same (256 levels), parts of a sum "
                  "(766), or the high byte in red and the low one in green (65536)"),
        config::key("compression", &s.compression)
            .choices({"auto", "off", "always"})
            .help("LZ4 where the display takes it; auto: when it saves time"),
        config::key("queue_frames", &s.queue_frames)
            .range(1, 64)
            .help("Frames that may wait for the display; more are dropped and counted"),
        config::key("calibration", &s.calibration)
            .help("Table made by obscura stimulator calibrate; empty: pixel for pixel on a linear screen"),
        config::key("black_dn", &s.black_dn)
            .unit("DN")
            .range(-65536, 65535)
            .help("Digital number that means no light"),
        config::key("white_dn", &s.white_dn)
            .unit("DN")
            .range(0, 65536)
            .help("Digital number that means the peak; 0: the highest of the ADC"),
        config::key("peak", &s.peak)
            .range(0, 1)
            .help("Luminance for white_dn, relative to the brightest place; 0: what the weakest place can "
                  "give"),
        config::key("dither", &s.dither)
            .choices({"none", "spatial", "temporal", "both"})
            .help("Over what parts of a drive level are averaged: 16x16 pixels, 256 frames, both, nothing"),
    };
}

} // namespace obscura::emulator
