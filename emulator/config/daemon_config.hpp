// Read this first: TOML files become plain structs here, checked whole or refused with one line.
#pragma once

#include "core/camera.hpp"
#include "renderer/scene/scene.hpp"
#include "sensors/description.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// [daemon]
struct DaemonSection {
    std::string log_level = "info"; ///< error, warning, notice, info, debug
    std::string realtime = "auto";  ///< off, auto (use SCHED_FIFO where permitted), required
    std::int32_t pool_frames = 12;
    std::uint64_t seed = 1;
    /// nominal: frame k shows the scene at (k - 1) nominal periods, so that frames can be made again offline;
    /// clock: at the time that really passed since the start of the acquisition.
    std::string scene_time = "nominal";
    bool drop_capabilities = true; ///< before anything listens
    bool autostart = false;        ///< acquire from the start; always so when no control port is enabled
};

/// [render]
struct RenderSection {
    std::int32_t samples_per_pixel = 4;
    double target_error = 0; ///< 0: samples_per_pixel everywhere; else more where needed
    std::int32_t max_samples_per_pixel = 64;
    std::int32_t max_instants = 256; ///< of one exposure, where something moves
    std::int32_t threads = 0;        ///< 0: one per core
    std::int32_t band_rows = 64;
};

/// [trigger.line1] to [trigger.line3]: what is wired to a further line of the camera.
struct LineSection {
    /// timer, ptp_timer, gpio, pps, ptp, udp, none (nothing is)
    std::string source = "none";
    double rate_hz = 10;                   ///< timer and pps; for the others the nominal rate
    double phase_ms = 0;                   ///< timer and pps
    std::string line;                      ///< gpio: a line's name or "gpiochipN:OFFSET"
    std::string edge = "rising";           ///< gpio: rising, falling, both
    std::string device;                    ///< pps and ptp: empty means /dev/pps0 or /dev/ptp0
    std::int32_t channel = 0;              ///< ptp: input of the clock
    std::string start;                     ///< ptp_timer: seconds of that clock; empty: its next full second
    std::string listen = "127.0.0.1:5002"; ///< udp: address and port
    double debounce_us = 0;
    std::int32_t divider = 1; ///< the first of every so many edges counts
    double delay_us = 0;

    bool operator==(const LineSection&) const = default;
};

/// [trigger]: the clock of the bench, seen by the camera as Line0, and what is wired to the lines after it.
struct TriggerSection : LineSection {
    TriggerSection() { source = "timer"; }
    std::string over_trigger = "count"; ///< edges that come too soon: count, ignore, latch
    std::array<LineSection, line_count - 1> more_lines{};

    /// Of Line`number`; its source may be lockstep, too, where that is Line0.
    [[nodiscard]] const LineSection& line_section(std::size_t number) const {
        return number == 0 ? *this : more_lines.at(number - 1);
    }
};

/// [ptp]: the PTP daemon of this machine, whose state clients see.
struct PtpSection {
    bool enabled = false;
    std::string socket = "/var/run/ptp4l"; ///< ptp4l's uds_address
    std::int32_t domain = 0;
    double lock_us = 10; ///< offset from the master below which the clock counts as locked
};

/// [simulator]: another program moves the scene, and time itself with trigger.source = "lockstep".
struct SimulatorSection {
    bool enabled = false;
    std::string listen = "127.0.0.1:5003"; ///< TCP for commands, UDP for poses
    double max_extrapolation_ms = 100;     ///< past the last pose; after that it holds
};

/// [outputs]: GPIO lines that tell what the camera is doing; empty: none.
struct OutputsSection {
    std::string trigger_ready, exposure;
    bool active_low = false;
};

/// [deadline]: rows that are not ready when the chip would have read them.
struct DeadlineSection {
    std::string policy = "late"; ///< late, repeat, drop, partial
    double grace_us = 0;         ///< after a row's time, before the policy applies
    double spin_us = 100;        ///< polling before a frame's first row; only under SCHED_FIFO
};

/// [[camera.window]]: one of several windows that are read in one frame, in their order.
struct WindowSection {
    std::int32_t width = 0, height = 0; ///< must be given
    std::int32_t offset_x = 0, offset_y = 0;
    double exposure_us = 0;               ///< not given: that of [camera]
    std::string sampling = "destructive"; ///< destructive, non-destructive, cds, ramp
    std::int32_t reads = 1;
};

/// [threads]: SCHED_FIFO priorities (0: ordinary scheduling) and cores ("2-3,5"; empty: any). Rendering has
/// no priority: a thread that computes for tens of milliseconds under SCHED_FIFO starves everything else on
/// its core.
struct ThreadsSection {
    std::int32_t trigger_priority = 80, release_priority = 75, transmit_priority = 70, detector_priority = 65;
    std::int32_t pipeline_priority = 0, display_priority = 0;
    std::string trigger_cores, release_cores, transmit_cores, detector_cores, pipeline_cores, display_cores;
    std::string render_cores;
};

/// [camera]: reset values of what a client may change over GigE Vision.
struct CameraSection {
    std::int32_t width = 0, height = 0; ///< 0: the whole sensor
    std::int32_t offset_x = 0, offset_y = 0;
    std::string pixel_format = "Mono16";
    double exposure_us = 10'000;
    double gain_db = 0;
    std::string trigger_mode = "On";
    std::string trigger_source = "Line0";
    std::string trigger_activation = "auto"; ///< auto: all edges that the line's source tells of
    std::string exposure_mode = "Timed";
    double frame_rate_hz = 10;
    std::string readout_timing = "sensor"; ///< when rows leave: sensor, fast
    std::int32_t rows_max = 0;             ///< of composed images; 0: what sensor and windows need
    std::vector<WindowSection> windows;    ///< empty: one, as the keys above say
};

/// [[gige.faults]]: one rule of what goes wrong on purpose. The same rules and seed strike the same packets.
struct FaultSection {
    std::string kind = "";
    double percent = 100;            ///< of the packets or frames that the rest of the rule allows
    std::uint64_t first = 1;         ///< frame (for mute_control and heartbeat_loss: command)
    std::uint64_t last = 0;          ///< 0: no end
    std::uint64_t every = 1;         ///< only every so many of them, beginning with the first
    std::uint32_t burst_packets = 1; ///< struck together
    double amount = 1;               ///< what it means depends on the kind
    std::uint64_t seed = 0;          ///< 0: the daemon's
};

/// [gige]
struct GigeSection {
    bool enabled = true;
    std::string interface = "lo"; ///< interface name or one of its IPv4 addresses
    std::int32_t port = 3956;
    std::string vendor = "Obscura", model = "Obscura-1", serial = "OBS000001", user_name = "";
    std::string mac = "";            ///< hardware address to show; empty: the interface's own
    std::int32_t packet_size = 1500; ///< reset value of GevSCPSPacketSize
    std::int32_t heartbeat_timeout_ms = 3000;
    std::int32_t history_frames = 4;       ///< frames kept for packet resend
    double drop_percent = 0;               ///< fault: packets left out on purpose at first sending
    double throughput_limit_mbit_s = 1000; ///< reset value of DeviceLinkThroughputLimit; 0: none
    std::string backend = "sendmmsg";      ///< sendmmsg, sendto, gso, auto
    std::string allow;                     ///< addresses and ranges, comma separated; empty: the whole link
    bool off_link = false;                 ///< answer sources behind a router, too
    bool read_only = false;                ///< nobody gets control
    std::string xml;                       ///< GenICam file shown in place of our own; empty: our own
    std::string xml_values;                ///< with `xml`: "Feature=value, ..." after reset
    std::string state_file;                ///< where user sets are kept; empty: in memory only
    std::vector<FaultSection> faults;
};

/// [file]
struct FileSection {
    bool enabled = false;
    std::string directory = "frames";
    std::string format = "png"; ///< png, fits, raw
    std::int32_t queue_frames = 4;
    bool truth = false; ///< also the truth about each pixel
};

/// [v4l2]: a Linux video output node.
struct V4l2Section {
    bool enabled = false;
    std::string device = "/dev/video10";
    std::string format = "Y16"; ///< GREY, Y10, Y12, Y14, Y16
    std::string io = "auto";    ///< auto, mmap, write
    std::int32_t buffers = 8;
    std::int32_t queue_frames = 4;
    bool frame_counter = false;
    bool required = false;
};

/// [stimulator]: a USB display in front of a real camera.
struct StimulatorSection {
    bool enabled = false;
    std::uint32_t vendor_id = 0x1d50, product_id = 0x614d;
    std::string serial = "";            ///< empty: the first device found
    std::int32_t width = 0, height = 0; ///< of the mode; 0: what the device prefers
    double refresh_hz = 0;              ///< of the mode; 0: what the device prefers
    std::string format = "auto";        ///< auto, R8, RGB888, XRGB8888
    std::string grey = "equal";         ///< equal, sum, high_low
    std::string compression = "auto";   ///< auto, off, always
    std::int32_t queue_frames = 2;
    std::string calibration = "";      ///< empty: pixel for pixel, linear
    double black_dn = 0, white_dn = 0; ///< white 0: the highest number of the ADC
    double peak = 0;                   ///< 0: as much as the weakest place of the screen can give
    std::string dither = "both";       ///< none, spatial, temporal, both
};

/// The configuration of one daemon and its camera; of the first one when there are several.
struct DaemonConfig {
    std::filesystem::path source; ///< the file it was read from; relative paths in it start from its folder
    std::filesystem::path scene_file;
    DaemonSection daemon;
    RenderSection render;
    TriggerSection trigger;
    PtpSection ptp;
    DeadlineSection deadline;
    SimulatorSection simulator;
    OutputsSection outputs;
    ThreadsSection threads;
    CameraSection camera;
    GigeSection gige;
    FileSection file;
    V4l2Section v4l2;
    StimulatorSection stimulator;
    SensorDescription sensor;
    scene::Scene scene;

    /// [[camera]]: the second and further cameras, each a whole configuration with the same [scene],
    /// [daemon], [render] and [ptp]. Empty under a single [camera]; then the following mean nothing.
    std::vector<DaemonConfig> others;
    bool several = false;     ///< written as [[camera]], perhaps with one element
    bool own_trigger = false; ///< has a [camera.trigger]; else what [trigger] names reaches it
    std::string view;         ///< the keys of [camera.view] that were given, as TOML

    /// This one and the others.
    [[nodiscard]] std::vector<const DaemonConfig*> cameras() const;
};

/// Reads a daemon configuration with its sensor and scene files. Nothing but files is touched. Throws
/// ConfigError with `file:line:column: key: what is wrong, what is allowed`.
[[nodiscard]] DaemonConfig load_config(const std::filesystem::path& file);

/// The effective configuration as TOML with every key, its unit, range and help as comments.
[[nodiscard]] std::string print_config(const DaemonConfig& config);

/// The reset CameraSettings of a configuration.
[[nodiscard]] CameraSettings camera_settings(const DaemonConfig& config);

} // namespace obscura::emulator
