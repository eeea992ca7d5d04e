#include "emulator/config/daemon_keys.hpp"

#include "renderer/scene/scene_file.hpp"
#include "sensors/sensor_file.hpp"

namespace obscura::emulator {
config::Keys keys_of(DaemonSection& s) {
    return {
        {"log_level",
         &s.log_level,
         {},
         {},
         {"error", "warning", "notice", "info", "debug"},
         "Least important lines that are logged"},
        {"realtime",
         &s.realtime,
         {},
         {},
         {"off", "auto", "required"},
         "SCHED_FIFO and locked memory: never, where permitted, or refuse to start without"},
        {"pool_frames", &s.pool_frames, {}, {3, 256}, {}, "Frames allocated at start"},
        {"seed", &s.seed, {}, {0, 9e15}, {}, "Same seed and trigger: same bytes"},
        {"scene_time",
         &s.scene_time,
         {},
         {},
         {"nominal", "clock"},
         "nominal: frame k shows the scene k - 1 nominal periods after its start, so that it can be made "
         "again "
         "offline; clock: as much later as really passed"},
        {"drop_capabilities",
         &s.drop_capabilities,
         {},
         {},
         {},
         "Give up the powers of root before anything listens; false where folders of other users are to be "
         "written or ports below 1024 are listened at"},
        {"autostart",
         &s.autostart,
         {},
         {},
         {},
         "Acquire from the start on; always so when no control port is enabled"},
    };
}

config::Keys keys_of(RenderSection& s) {
    return {
        {"samples_per_pixel",
         &s.samples_per_pixel,
         {},
         {1, 65536},
         {},
         "Rays per pixel that a body may cover"},
        {"target_error",
         &s.target_error,
         {},
         {0, 1},
         {},
         "Take more samples until a pixel's relative standard error is about this; 0: samples_per_pixel "
         "everywhere"},
        {"max_samples_per_pixel",
         &s.max_samples_per_pixel,
         {},
         {1, 65536},
         {},
         "Limit that goes with target_error"},
        {"max_instants",
         &s.max_instants,
         {},
         {1, 4096},
         {},
         "Instants that an exposure is made of, at most, where something moves in it; 1: all is seen at its "
         "middle"},
        {"threads", &s.threads, {}, {0, 1024}, {}, "Render threads; 0: one per core"},
        {"band_rows", &s.band_rows, {}, {1, 16384}, {}, "Rows rendered, exposed and sent together"},
    };
}

config::Keys keys_of(LineSection& s) {
    return {
        {"source",
         &s.source,
         {},
         {},
         {"timer", "ptp_timer", "gpio", "pps", "ptp", "udp", "none"},
         "What is wired to this line of the camera: a source as in [trigger], or nothing"},
        {"rate_hz",
         &s.rate_hz,
         "Hz",
         {0.001, 10000},
         {},
         "Rate of timer, ptp_timer and pps; for other sources the nominal rate that scene_time counts in"},
        {"phase_ms", &s.phase_ms, "ms", {0, 1e6}, {}, "timer, ptp_timer and pps: shift of the edges"},
        {"line", &s.line, {}, {}, {}, "gpio: name of the line, or \"gpiochipN:OFFSET\""},
        {"edge", &s.edge, {}, {}, {"rising", "falling", "both"}, "gpio: which edges count"},
        {"device",
         &s.device,
         {},
         {},
         {},
         "pps, ptp and ptp_timer: device node; empty: /dev/pps0 or /dev/ptp0"},
        {"channel", &s.channel, {}, {0, 64}, {}, "ptp: input of the clock"},
        {"start",
         &s.start,
         {},
         {},
         {},
         "ptp_timer: the first edge, in seconds of that clock (TAI since 1970), like \"1795244437.5\"; "
         "empty: "
         "its next full second"},
        {"listen", &s.listen, {}, {}, {}, "udp: address and port that triggers are sent to"},
        {"debounce_us",
         &s.debounce_us,
         "us",
         {0, 1e6},
         {},
         "An edge sooner than this after another is a bounce"},
        {"divider", &s.divider, {}, {1, 1000000}, {}, "The first of every so many edges is a trigger"},
        {"delay_us", &s.delay_us, "us", {0, 1e7}, {}, "From the edge to the start of the exposure"},
    };
}

config::Keys keys_of(TriggerSection& s) {
    config::Keys keys = keys_of(static_cast<LineSection&>(s));
    keys.front() = {
        "source",
        &s.source,
        {},
        {},
        {"timer", "ptp_timer", "gpio", "pps", "ptp", "udp", "lockstep", "none"},
        "What drives Line0: a timer on an absolute schedule, the same in the time of a PTP clock, "
        "edges of a GPIO line, instants in step with a pulse per second, edges on a PTP clock's "
        "input, UDP datagrams, steps of a simulator, or nothing (software triggers only)"};
    keys.push_back({"over_trigger",
                    &s.over_trigger,
                    {},
                    {},
                    {"count", "ignore", "latch"},
                    "An edge before the camera is ready again is missed, of no interest, or (the first one) "
                    "kept until it is"});
    return keys;
}

config::Keys keys_of(PtpSection& s) {
    return {
        {"enabled",
         &s.enabled,
         {},
         {},
         {},
         "Ask ptp4l how its clock is doing: shown as Ptp* features, and time stamps are TAI once it is "
         "locked"},
        {"socket", &s.socket, {}, {}, {}, "Its management socket (uds_address)"},
        {"domain", &s.domain, {}, {0, 127}, {}, "Its domain (domainNumber)"},
        {"lock_us",
         &s.lock_us,
         "us",
         {0.001, 1e6},
         {},
         "The clock of a slave counts as locked while its offset from the master is not above this"},
    };
}

config::Keys keys_of(DeadlineSection& s) {
    return {
        {"policy",
         &s.policy,
         {},
         {},
         {"late", "repeat", "drop", "partial"},
         "A frame with a row that is not ready in time: leaves late, shows the frame before, is given up, or "
         "ends "
         "there"},
        {"grace_us",
         &s.grace_us,
         "us",
         {0, 1e7},
         {},
         "How long after a row's time the policy applies (not late)"},
        {"spin_us",
         &s.spin_us,
         "us",
         {0, 1000},
         {},
         "Poll the clock for the last so much before a frame's first row; only under SCHED_FIFO"},
    };
}

config::Keys keys_of(SimulatorSection& s) {
    return {
        {"enabled", &s.enabled, {}, {}, {}, "Let another program say where things are, and make steps"},
        {"listen", &s.listen, {}, {}, {}, "Address and port: TCP for commands, UDP for poses"},
        {"max_extrapolation_ms",
         &s.max_extrapolation_ms,
         "ms",
         {0, 1e6},
         {},
         "How long a motion goes on past its last pose; after that it holds"},
    };
}

config::Keys keys_of(OutputsSection& s) {
    return {
        {"trigger_ready",
         &s.trigger_ready,
         {},
         {},
         {},
         "GPIO line that is active while a trigger would be taken, by name or \"gpiochipN:OFFSET\"; empty: "
         "none"},
        {"exposure",
         &s.exposure,
         {},
         {},
         {},
         "GPIO line that is active from the first row's reset to the last row's readout; empty: none"},
        {"active_low", &s.active_low, {}, {}, {}, "Active means a low level"},
    };
}

config::Keys keys_of(ThreadsSection& s) {
    const config::Range fifo{0, 98};
    return {
        {"trigger_priority",
         &s.trigger_priority,
         {},
         fifo,
         {},
         "SCHED_FIFO priority of what waits for edges"},
        {"release_priority", &s.release_priority, {}, fifo, {}, "Of what lets rows out at their times"},
        {"transmit_priority",
         &s.transmit_priority,
         {},
         fifo,
         {},
         "Of what sends GigE Vision; its control is one above"},
        {"detector_priority", &s.detector_priority, {}, fifo, {}, "Of the detector"},
        {"pipeline_priority",
         &s.pipeline_priority,
         {},
         fifo,
         {},
         "Of what takes triggers and renders along; 0: ordinary scheduling"},
        {"display_priority", &s.display_priority, {}, fifo, {}, "Of what feeds V4L2 and the stimulator"},
        {"trigger_cores", &s.trigger_cores, {}, {}, {}, "Cores of that thread, like \"2-3,5\"; empty: any"},
        {"release_cores", &s.release_cores, {}, {}, {}, "The same"},
        {"transmit_cores", &s.transmit_cores, {}, {}, {}, "The same"},
        {"detector_cores", &s.detector_cores, {}, {}, {}, "The same"},
        {"pipeline_cores", &s.pipeline_cores, {}, {}, {}, "The same"},
        {"display_cores", &s.display_cores, {}, {}, {}, "The same"},
        {"render_cores", &s.render_cores, {}, {}, {}, "The same, of all render threads"},
    };
}

config::Keys keys_of(CameraSection& s) {
    return {
        {"width", &s.width, "px", {0, 65536}, {}, "Width after reset; 0: the whole sensor"},
        {"height", &s.height, "px", {0, 65536}, {}, "Height after reset; 0: the whole sensor"},
        {"offset_x", &s.offset_x, "px", {0, 65535}, {}, "OffsetX after reset"},
        {"offset_y", &s.offset_y, "px", {0, 65535}, {}, "OffsetY after reset"},
        {"pixel_format",
         &s.pixel_format,
         {},
         {},
         {"Mono8", "Mono10", "Mono12", "Mono14", "Mono16", "Mono10p", "Mono12p"},
         "PixelFormat after reset"},
        {"exposure_us", &s.exposure_us, "us", {1, 1e7}, {}, "ExposureTime after reset"},
        {"gain_db", &s.gain_db, "dB", {0, 48}, {}, "Gain after reset"},
        {"trigger_mode", &s.trigger_mode, {}, {}, {"On", "Off"}, "TriggerMode after reset; Off: free run"},
        {"trigger_source",
         &s.trigger_source,
         {},
         {},
         {"Line0", "Line1", "Line2", "Line3", "Software", "Action1"},
         "TriggerSource after reset; Line0 is what [trigger] drives, Line1 what [trigger.line1] does"},
        {"trigger_activation",
         &s.trigger_activation,
         {},
         {},
         {"auto", "RisingEdge", "FallingEdge", "AnyEdge", "LevelHigh", "LevelLow"},
         "TriggerActivation after reset; auto: all edges that the line's source tells of"},
        {"exposure_mode",
         &s.exposure_mode,
         {},
         {},
         {"Timed", "TriggerWidth"},
         "ExposureMode after reset; TriggerWidth: exposed as long as the pulse of the trigger lasts (gpio, "
         "edge = "
         "\"both\")"},
        {"frame_rate_hz",
         &s.frame_rate_hz,
         "Hz",
         {0.01, 1000},
         {},
         "AcquisitionFrameRate after reset (free run, and while a level holds)"},
        {"readout_timing",
         &s.readout_timing,
         {},
         {},
         {"sensor", "fast"},
         "Rows leave as the chip reads them, or as soon as they are rendered; triggers and exposures are the "
         "chip's either way"},
        {"rows_max",
         &s.rows_max,
         "px",
         {0, 1048576},
         {},
         "Rows of images composed of several windows that a client may ask for; 0: what sensor and windows "
         "need"},
    };
}

config::Keys keys_of(WindowSection& s) {
    return {
        {"width", &s.width, "px", {1, 65536}, {}, "Width of the window"},
        {"height", &s.height, "px", {1, 65536}, {}, "Height of the window; push-broom: lines"},
        {"offset_x", &s.offset_x, "px", {0, 65535}, {}, "Its first column on the sensor"},
        {"offset_y", &s.offset_y, "px", {0, 65535}, {}, "Its first row on the sensor"},
        {"exposure_us",
         &s.exposure_us,
         "us",
         {1, 1e7},
         {},
         "Its integration time; not given: that of [camera]"},
        {"sampling",
         &s.sampling,
         {},
         {},
         {"destructive", "non-destructive", "cds", "ramp"},
         "How it is read: sample and reset; every one of several reads without a reset; the last less the "
         "first of them; a line fitted through them"},
        {"reads", &s.reads, {}, {1, 64}, {}, "Reads of a window that is not read destructively"},
    };
}

config::Keys keys_of(GigeSection& s) {
    return {
        {"enabled", &s.enabled, {}, {}, {}, "Be a GigE Vision camera"},
        {"interface", &s.interface, {}, {}, {}, "Network interface, or one of its IPv4 addresses"},
        {"port", &s.port, {}, {1, 65535}, {}, "UDP port of GVCP; clients look on 3956"},
        {"vendor", &s.vendor, {}, {}, {}, "DeviceVendorName, at most 31 characters"},
        {"model", &s.model, {}, {}, {}, "DeviceModelName, at most 31 characters"},
        {"serial", &s.serial, {}, {}, {}, "DeviceSerialNumber, at most 15 characters"},
        {"user_name", &s.user_name, {}, {}, {}, "DeviceUserID, at most 15 characters"},
        {"mac",
         &s.mac,
         {},
         {},
         {},
         "Hardware address to show, like \"02:4f:00:00:00:01\"; empty: the interface's own, or one made from "
         "the "
         "address where several cameras share an interface"},
        {"packet_size",
         &s.packet_size,
         "bytes",
         {576, 16260},
         {},
         "GevSCPSPacketSize after reset: IP, UDP and GVSP headers and data; not above the interface's MTU"},
        {"heartbeat_timeout_ms",
         &s.heartbeat_timeout_ms,
         "ms",
         {500, 600000},
         {},
         "GevHeartbeatTimeout after reset"},
        {"history_frames", &s.history_frames, {}, {1, 64}, {}, "Frames kept for packet resend"},
        {"drop_percent",
         &s.drop_percent,
         "%",
         {0, 100},
         {},
         "Fault: packets left out on purpose when first sent"},
        {"throughput_limit_mbit_s",
         &s.throughput_limit_mbit_s,
         "Mbit/s",
         {0, 100000},
         {},
         "DeviceLinkThroughputLimit after reset: the pace of the packets; 0: none, for receivers that keep "
         "up"},
        {"backend",
         &s.backend,
         {},
         {},
         {"sendmmsg", "sendto", "gso", "auto"},
         "How packets reach the kernel: batches, one by one, super-packets (UDP segmentation offload), or "
         "super-packets only towards a real network card"},
        {"allow",
         &s.allow,
         {},
         {},
         {},
         "Who may talk to the camera, like \"192.168.7.0/24, 192.168.8.4\"; empty: everybody on the link"},
        {"off_link", &s.off_link, {}, {}, {}, "Answer sources behind a router, too"},
        {"read_only", &s.read_only, {}, {}, {}, "Nobody gets control; for looking at a camera only"},
        {"xml",
         config::Path{&s.xml, true, true},
         {},
         {},
         {},
         "GenICam file of a real camera to show in place of our own; its features are bound by SFNC name"},
        {"xml_values",
         &s.xml_values,
         {},
         {},
         {},
         "With xml: what other features hold after reset, like \"HeaterSetPoint=20, SerialText=FM-03\""},
        {"state_file",
         config::Path{&s.state_file, false, true},
         {},
         {},
         {},
         "Where user sets are kept; empty: in memory"},
    };
}

config::Keys keys_of(FaultSection& s) {
    return {
        {"kind",
         &s.kind,
         {},
         {},
         {"lose", "lose_for_good", "duplicate", "reorder", "delay", "corrupt", "drop_leader", "drop_trailer",
          "skip_frame", "freeze_frame", "repeat_frame", "wrong_block_id", "wrong_timestamp", "mute_control",
          "heartbeat_loss"},
         "What goes wrong: with payload packets, with whole frames, or with the answers to commands"},
        {"percent", &s.percent, "%", {0, 100}, {}, "How many of those that the other keys let it strike"},
        {"first",
         &s.first,
         {},
         {1, 9e15},
         {},
         "First frame, counted since the client opened its stream; for mute_control and heartbeat_loss first "
         "command, counted since the start"},
        {"last", &s.last, {}, {0, 9e15}, {}, "Last frame or command; 0: no end"},
        {"every", &s.every, {}, {1, 9e15}, {}, "Only every so many frames or commands, from the first on"},
        {"burst_packets", &s.burst_packets, {}, {1, 65536}, {}, "Neighbouring packets struck together"},
        {"amount",
         &s.amount,
         {},
         {-1e9, 1e9},
         {},
         "delay, wrong_timestamp: by how many microseconds; wrong_block_id: by how much too high"},
        {"seed", &s.seed, {}, {0, 9e15}, {}, "Of the choice by percent; 0: that of the daemon"},
    };
}

config::Keys keys_of(FileSection& s) {
    return {
        {"enabled", &s.enabled, {}, {}, {}, "Write every frame to a file"},
        {"directory", config::Path{&s.directory, false}, {}, {}, {}, "Folder for the files; made if need be"},
        {"format", &s.format, {}, {}, {"png", "fits", "raw"}, "Kind of file"},
        {"queue_frames",
         &s.queue_frames,
         {},
         {1, 256},
         {},
         "Frames that may wait for the disk; more are dropped and counted"},
        {"truth",
         &s.truth,
         {},
         {},
         {},
         "Also write truth_NNNNNN.fits: electrons before noise, saturated pixels, row times, particles"},
    };
}

config::Keys keys_of(V4l2Section& s) {
    return {
        {"enabled", &s.enabled, {}, {}, {}, "Feed a Linux video output node (v4l2loopback or another)"},
        {"device", &s.device, {}, {}, {}, "The node"},
        {"format",
         &s.format,
         {},
         {},
         {"GREY", "Y10", "Y12", "Y14", "Y16"},
         "Pixel format; Y: digital numbers as they are, low bit first; GREY: their high 8 bits"},
        {"io",
         &s.io,
         {},
         {},
         {"auto", "mmap", "write"},
         "Way into the driver; auto: mmap, which carries trigger time stamps, unless the driver mixes "
         "buffers up"},
        {"buffers", &s.buffers, {}, {2, 32}, {}, "Buffers asked of the driver for mmap"},
        {"queue_frames",
         &s.queue_frames,
         {},
         {1, 256},
         {},
         "Frames that may wait for the node; more are dropped and counted"},
        {"frame_counter",
         &s.frame_counter,
         {},
         {},
         {},
         "Put the frame number into the first four pixels, a byte each, lowest first"},
        {"required", &s.required, {}, {}, {}, "Do not start without the node; else it is waited for"},
    };
}

config::Keys keys_of(StimulatorSection& s) {
    return {
        {"enabled",
         &s.enabled,
         {},
         {},
         {},
         "Show every frame on a USB display (GUD) in front of a real camera"},
        {"vendor_id", &s.vendor_id, {}, {0, 65535}, {}, "USB vendor number of the display"},
        {"product_id", &s.product_id, {}, {0, 65535}, {}, "USB product number of the display"},
        {"serial", &s.serial, {}, {}, {}, "Its serial number; empty: the first display found"},
        {"width", &s.width, "px", {0, 16384}, {}, "Of its mode; 0: what the display prefers"},
        {"height", &s.height, "px", {0, 16384}, {}, "Of its mode; 0: what the display prefers"},
        {"refresh_hz", &s.refresh_hz, "Hz", {0, 10000}, {}, "Of its mode; 0: what the display prefers"},
        {"format",
         &s.format,
         {},
         {},
         {"auto", "R8", "RGB888", "XRGB8888"},
         "Pixels on the wire; auto: the first it takes"},
        {"grey",
         &s.grey,
         {},
         {},
         {"equal", "sum", "high_low"},
         "What the channels of a colour format carry: all the same (256 levels), parts of a sum (766), or "
         "the high "
         "byte in red and the low one in green (65536)"},
        {"compression",
         &s.compression,
         {},
         {},
         {"auto", "off", "always"},
         "LZ4 where the display takes it; auto: when it saves time"},
        {"queue_frames",
         &s.queue_frames,
         {},
         {1, 64},
         {},
         "Frames that may wait for the display; more are dropped and counted"},
        {"calibration",
         &s.calibration,
         {},
         {},
         {},
         "Table made by obscura stimulator calibrate; empty: pixel for pixel on a linear screen"},
        {"black_dn", &s.black_dn, "DN", {-65536, 65535}, {}, "Digital number that means no light"},
        {"white_dn",
         &s.white_dn,
         "DN",
         {0, 65536},
         {},
         "Digital number that means the peak; 0: the highest of the ADC"},
        {"peak",
         &s.peak,
         {},
         {0, 1},
         {},
         "Luminance for white_dn, relative to the brightest place; 0: what the weakest place can give"},
        {"dither",
         &s.dither,
         {},
         {},
         {"none", "spatial", "temporal", "both"},
         "Over what parts of a drive level are averaged: 16x16 pixels, 256 frames, both, nothing"},
    };
}

} // namespace obscura::emulator
