#include "config/tables.hpp"

namespace obscura::config {
namespace {

constexpr double micro = 1e-6;

/// A key whose words stand for the values of an enumeration.
template<typename Enum>
Word word(Enum& target, std::vector<std::pair<std::string_view, Enum>> words) {
    const auto set = [&target, words](std::string_view name) {
        for (const auto& [text, value] : words)
            if (text == name) target = value;
    };
    const auto get = [&target, words] {
        for (const auto& [text, value] : words)
            if (value == target) return std::string(text);
        return std::string();
    };
    return {set, get};
}

} // namespace

Keys keys_of(DaemonSection& s) {
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
        {"autostart",
         &s.autostart,
         {},
         {},
         {},
         "Acquire from the start on; always so when no control port is enabled"},
    };
}

Keys keys_of(RenderSection& s) {
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
        {"threads", &s.threads, {}, {0, 1024}, {}, "Render threads; 0: one per core"},
        {"band_rows", &s.band_rows, {}, {1, 16384}, {}, "Rows rendered, exposed and sent together"},
    };
}

Keys keys_of(TriggerSection& s) {
    return {
        {"source",
         &s.source,
         {},
         {},
         {"timer", "none"},
         "What drives Line0: a timer on an absolute schedule, or nothing (software triggers only)"},
        {"rate_hz", &s.rate_hz, "Hz", {0.001, 10000}, {}, "Rate of the timer"},
        {"phase_ms", &s.phase_ms, "ms", {0, 1e6}, {}, "Shift of the timer's edges"},
    };
}

Keys keys_of(CameraSection& s) {
    return {
        {"width", &s.width, "px", {0, 65536}, {}, "Width after reset; 0: the whole sensor"},
        {"height", &s.height, "px", {0, 65536}, {}, "Height after reset; 0: the whole sensor"},
        {"offset_x", &s.offset_x, "px", {0, 65535}, {}, "OffsetX after reset"},
        {"offset_y", &s.offset_y, "px", {0, 65535}, {}, "OffsetY after reset"},
        {"pixel_format", &s.pixel_format, {}, {}, {"Mono8", "Mono16"}, "PixelFormat after reset"},
        {"exposure_us", &s.exposure_us, "us", {1, 1e7}, {}, "ExposureTime after reset"},
        {"gain_db", &s.gain_db, "dB", {0, 48}, {}, "Gain after reset"},
        {"trigger_mode", &s.trigger_mode, {}, {}, {"On", "Off"}, "TriggerMode after reset; Off: free run"},
        {"trigger_source",
         &s.trigger_source,
         {},
         {},
         {"Line0", "Software", "Action1"},
         "TriggerSource after reset; Line0 is what [trigger] drives"},
        {"frame_rate_hz",
         &s.frame_rate_hz,
         "Hz",
         {0.01, 1000},
         {},
         "AcquisitionFrameRate after reset (free run)"},
    };
}

Keys keys_of(GigeSection& s) {
    return {
        {"enabled", &s.enabled, {}, {}, {}, "Be a GigE Vision camera"},
        {"interface", &s.interface, {}, {}, {}, "Network interface, or one of its IPv4 addresses"},
        {"port", &s.port, {}, {1, 65535}, {}, "UDP port of GVCP; clients look on 3956"},
        {"vendor", &s.vendor, {}, {}, {}, "DeviceVendorName, at most 31 characters"},
        {"model", &s.model, {}, {}, {}, "DeviceModelName, at most 31 characters"},
        {"serial", &s.serial, {}, {}, {}, "DeviceSerialNumber, at most 15 characters"},
        {"user_name", &s.user_name, {}, {}, {}, "DeviceUserID, at most 15 characters"},
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
    };
}

Keys keys_of(FileSection& s) {
    return {
        {"enabled", &s.enabled, {}, {}, {}, "Write every frame to a file"},
        {"directory", Path{&s.directory, false}, {}, {}, {}, "Folder for the files; made if need be"},
        {"format", &s.format, {}, {}, {"png", "fits", "raw"}, "Kind of file"},
        {"queue_frames",
         &s.queue_frames,
         {},
         {1, 256},
         {},
         "Frames that may wait for the disk; more are dropped and counted"},
    };
}

Keys keys_of(V4l2Section& s) {
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

Keys keys_of(SensorDescription& s) {
    return {
        {"name", &s.name, {}, {}, {}, "Name of the chip"},
        {"serial", &s.serial, {}, {0, 9e15}, {}, "Specimen: seeds the fixed patterns"},
        {"pixel_pitch_um", Scaled{&s.pixel_pitch_m, micro}, "um", {0.1, 1000}, {}, "Pixel pitch"},
    };
}

Keys keys_of(ReadoutSettings& s) {
    const Word shutter = word(
        s.shutter,
        {{"rolling", Shutter::rolling}, {"global", Shutter::global}, {"push-broom", Shutter::push_broom}});
    const Word window_mode = word(
        s.window_mode, {{"sequential", WindowMode::sequential}, {"interleaved", WindowMode::interleaved}});
    return {
        {"width", &s.width, "px", {1, 65536}, {}, "Columns of the array"},
        {"height", &s.height, "px", {1, 65536}, {}, "Rows of the array"},
        {"shutter", shutter, {}, {}, {"rolling", "global", "push-broom"}, "Shutter"},
        {"pixel_clock_hz", &s.pixel_clock_hz, "Hz", {1e3, 1e11}, {}, "Pixel clock of one output"},
        {"outputs", &s.outputs, {}, {1, 4096}, {}, "Pixels of a row read at once"},
        {"row_overhead_ns",
         &s.row_overhead_ns,
         "ns",
         {0, 1e9},
         {},
         "Row time beside the pixels: T_row = row_overhead + ceil(width / outputs) / pixel_clock"},
        {"sample_instant_ns", &s.sample_instant_ns, "ns", {0, 1e9}, {}, "Signal sample inside a row slot"},
        {"reset_instant_ns",
         &s.reset_instant_ns,
         "ns",
         {0, 1e9},
         {},
         "Reset inside a row slot: sample_instant < reset_instant < row_overhead"},
        {"frame_overhead_ns",
         &s.frame_overhead_ns,
         "ns",
         {0, 1e9},
         {},
         "Global shutter: charge transfer between exposure and readout"},
        {"overlapped", &s.overlapped, {}, {}, {}, "The next exposure may start while a frame is read out"},
        {"window_mode",
         window_mode,
         {},
         {},
         {"sequential", "interleaved"},
         "How a rolling shutter serves several windows: one after the other, or all in every cycle"},
        {"windows_max", &s.windows_max, {}, {1, 32}, {}, "Windows at once"},
        {"window_overhead_ns",
         &s.window_overhead_ns,
         "ns",
         {0, 1e9},
         {},
         "After the last row of each window"},
        {"blanking_rows", &s.blanking_rows, {}, {0, 1e6}, {}, "Idle row slots at the end of each cycle"},
        {"stretch_blanking",
         &s.stretch_blanking,
         {},
         {},
         {},
         "Add idle slots for an exposure that is longer than the cycle"},
        {"exposure_step_ns",
         &s.exposure_step_ns,
         "ns",
         {1, 1e9},
         {},
         "Global shutter and push-broom: exposures are multiples of this"},
        {"line_rate_hz", &s.line_rate_hz, "Hz", {1e-3, 1e7}, {}, "Push-broom: lines per second"},
        {"window_step", &s.window_step, "px", {1, 4096}, {}, "Place of a window is a multiple of this"},
        {"strict", &s.strict, {}, {}, {}, "Refuse impossible windows; otherwise crop and align them"},
    };
}

Keys keys_of(DetectorSettings& s) {
    return {
        {"transmission", &s.transmission, {}, {0, 1}, {}, "Transmission of the optics"},
        {"quantum_efficiency",
         Curve{&s.quantum_efficiency},
         {},
         {0, 1},
         {},
         "[wavelength_nm, quantum efficiency x fill factor] pairs; linear between, ends held"},
        {"full_well_e", &s.full_well_e, "e-", {1, 1e9}, {}, "Full well capacity"},
        {"dark_current_e_per_s", &s.dark_current_e_per_s, "e-/s", {0, 1e9}, {}, "Dark current"},
        {"read_noise_e", &s.read_noise_e, "e-", {0, 1e6}, {}, "Temporal read noise, sigma_d"},
        {"gain_dn_per_e", &s.gain_dn_per_e, "DN/e-", {1e-9, 1e6}, {}, "System gain K at 0 dB"},
        {"offset_dn", &s.offset_dn, "DN", {0, 65535}, {}, "Black level"},
        {"adc_bits", &s.adc_bits, "bit", {8, 16}, {}, "Depth of the converter"},
    };
}

} // namespace obscura::config
