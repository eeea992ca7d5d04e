#include "emulator/assemble.hpp"

#include "core/error.hpp"
#include "emulator/releaser.hpp"
#include "sync/settings.hpp"
#include "sync/sources/gpio.hpp"
#include "sync/sources/ptp.hpp"
#include "sync/sources/ptp_timer.hpp"
#include "sync/sources/udp.hpp"
#include "transports/file/file_sink.hpp"
#include "transports/gige/gige.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/stimulator_output.hpp"
#include "transports/v4l2/v4l2_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

namespace obscura::emulator {

CameraLimits camera_limits(const SensorDescription& sensor, std::int32_t rows_max) {
    CameraLimits limits;
    limits.sensor_width = sensor.readout.width;
    limits.sensor_height = sensor.readout.height;
    limits.windows_max = static_cast<std::uint32_t>(sensor.readout.windows_max);
    limits.rows_max = std::max(rows_max, sensor.readout.height);
    limits.strict = sensor.readout.strict;
    limits.adc_bits = sensor.detector.adc_bits;
    limits.black_level_max_dn = std::exp2(sensor.detector.adc_bits - 1);
    limits.black_level_min_dn = std::min(0.0, sensor.detector.offset_dn);
    limits.temperature_c = sensor.detector.temperature_c;
    limits.overlapped = sensor.readout.overlapped;
    limits.global_shutter = sensor.readout.shutter == Shutter::global;
    limits.sensor_name = sensor.name;
    return limits;
}

namespace {

/// Line that triggers frames by the initial settings; Line0 if none does.
std::size_t trigger_line(const emulator::DaemonConfig& config) {
    const std::size_t line = line_of(emulator::camera_settings(config).frame_trigger.source);
    return line < line_count ? line : 0;
}

LineEdges edges_of(const emulator::LineSection& line, bool always) {
    if (line.source == "none" && !always) return {};
    if (line.source != "gpio") return {.rising = true};
    return {line.edge != "falling", line.edge != "rising"};
}

TriggerActivation activation_named(const std::string& name, const LineEdges& edges) {
    if (name == "RisingEdge") return TriggerActivation::rising_edge;
    if (name == "FallingEdge") return TriggerActivation::falling_edge;
    if (name == "AnyEdge") return TriggerActivation::any_edge;
    if (name == "LevelHigh") return TriggerActivation::level_high;
    if (name == "LevelLow") return TriggerActivation::level_low;
    // All edges that there are.
    if (edges.both()) return TriggerActivation::any_edge;
    return edges.falling ? TriggerActivation::falling_edge : TriggerActivation::rising_edge;
}

} // namespace

sync::RationalRate nominal_trigger_rate(const emulator::DaemonConfig& config) {
    const std::size_t number = trigger_line(config);
    const emulator::LineSection& line = config.trigger.line_section(number);
    const double rate_hz = line.rate_hz / line.divider;
    if (rate_hz < 1e-6)
        throw ConfigError(fmt::format(
            "{}: {}.divider: {} leaves {} Hz, allowed are 1e-6 Hz and more", config.source.string(),
            number == 0 ? "trigger" : fmt::format("trigger.line{}", number), line.divider, rate_hz));
    return sync::rational_rate(rate_hz);
}

std::unique_ptr<renderer::Renderer> make_renderer(const emulator::DaemonConfig& config, scene::Scene scene,
                                                  const ThreadPlan& threads) {
    const PinnedHere pinned(threads.render.cores); // the renderer's threads inherit the affinity
    return std::make_unique<renderer::Renderer>(
        std::move(scene),
        renderer::RenderSettings{static_cast<std::uint32_t>(config.render.samples_per_pixel),
                                 static_cast<std::uint32_t>(config.render.threads), config.daemon.seed,
                                 config.render.target_error,
                                 static_cast<std::uint32_t>(config.render.max_samples_per_pixel), 0,
                                 static_cast<std::uint32_t>(config.render.max_instants)});
}

Imaging::Imaging(const emulator::DaemonConfig& config, std::size_t pool_frames, const ThreadPlan& threads,
                 bool pixel_truth) {
    camera.initial = emulator::camera_settings(config);
    camera.limits =
        camera_limits(config.sensor, std::max(config.camera.rows_max, composed_size(camera.initial).height));
    for (std::size_t i = 0; i < line_count; ++i)
        camera.limits.lines[i] = edges_of(config.trigger.line_section(i), i == 0);
    camera.initial.frame_trigger.activation =
        activation_named(config.camera.trigger_activation, camera.limits.lines[trigger_line(config)]);
    for (TriggerChoice* other :
         {&camera.initial.start_trigger, &camera.initial.burst_trigger, &camera.initial.exposure_trigger})
        other->activation = activation_named("auto", camera.limits.lines[0]);
    camera.scene_time = config.daemon.scene_time == "clock" ? SceneTime::clock : SceneTime::nominal;
    camera.trigger_rate = nominal_trigger_rate(config);
    camera.over_trigger = config.trigger.over_trigger == "latch"    ? sync::OverTrigger::latch
                          : config.trigger.over_trigger == "ignore" ? sync::OverTrigger::ignore
                                                                    : sync::OverTrigger::count;
    camera.initial.trigger_overlap = camera.over_trigger == sync::OverTrigger::latch
                                         ? TriggerOverlap::previous_frame
                                     : camera.limits.overlapped ? TriggerOverlap::readout
                                                                : TriggerOverlap::off;
    if (const std::string complaint = explain_invalid(camera.initial, camera.limits); !complaint.empty())
        throw ConfigError(fmt::format("{}: camera: {}", config.source.string(), complaint));

    camera.thread = threads.pipeline;
    camera.trigger_thread = threads.trigger;

    scene::Scene scene = config.scene;
    if (config.simulator.enabled)
        poses = attach_pose_rings(scene, config.simulator.max_extrapolation_ms * 1e-3);
    renderer = make_renderer(config, std::move(scene), threads);
    detector = std::make_unique<sensors::Detector>(config.sensor, config.scene.bands,
                                                   config.scene.camera.aperture_m, config.daemon.seed);
    maker = std::make_unique<FrameMaker>(*renderer, *detector, config.sensor, clock,
                                         FrameMakerSettings{config.render.band_rows, camera.limits.rows_max,
                                                            config.daemon.seed, threads.detector});
    if (const std::string complaint = maker->answer(camera.initial).refusal; !complaint.empty())
        throw ConfigError(fmt::format("{}: camera: {}", config.source.string(), complaint));
    const auto rows = static_cast<std::size_t>(camera.limits.rows_max);
    pool = std::make_unique<FramePool>(
        pool_frames, rows * static_cast<std::size_t>(config.sensor.readout.width), rows, pixel_truth);
}

void Imaging::catch_up(std::uint64_t first) {
    for (std::uint64_t id = 1; id < first; ++id) {
        maker->skip(nominal_order(id));
        // A frame that begins after the readout of the frame before does not depend on it.
        if (!maker->overlaps(nominal_order(id + 1).scene_time + camera.initial.trigger_delay_ns)) return;
    }
}

FrameOrder Imaging::nominal_order(std::uint64_t frame_id) const {
    FrameOrder order;
    order.frame_id = order.trigger_id = frame_id;
    order.settings = camera.initial;
    order.scene_time = nominal_scene_time(camera.initial, camera.trigger_rate, frame_id);
    order.trigger_edge = order.seen = order.scene_time;
    return order;
}

namespace {

std::int64_t from_us(double us) {
    return std::llround(us * static_cast<double>(ns_per_us));
}

} // namespace

sync::ConditionerSettings conditioner_settings(const emulator::LineSection& line) {
    return {from_us(line.debounce_us), static_cast<std::uint32_t>(line.divider), from_us(line.delay_us)};
}

std::unique_ptr<sync::TriggerSource> make_trigger_source(const emulator::LineSection& line,
                                                         const Clock& clock, const ThreadPlan& threads) {
    sync::TriggerLineSettings settings;
    settings.source = line.source;
    settings.rate_hz = line.rate_hz;
    settings.phase_ms = line.phase_ms;
    settings.device = line.device;
    settings.debounce_us = line.debounce_us;
    auto& gpio = settings.kinds.get<sync::GpioKind>();
    gpio.line = line.line;
    gpio.edge = enum_named<sync::GpioEdge>(line.edge).value_or(sync::GpioEdge::rising);
    settings.kinds.get<sync::PtpKind>().channel = line.channel;
    settings.kinds.get<sync::UdpKind>().listen = line.listen;
    settings.kinds.get<sync::PtpTimerKind>().start = line.start;
    return sync::make_source(settings, clock, threads.trigger);
}

namespace {

using TransportPtr = std::unique_ptr<transports::Transport>;

transports::gige::FaultRule fault_rule(const emulator::DaemonConfig& config,
                                       const emulator::FaultSection& section) {
    transports::gige::FaultRule rule;
    const auto fault = enum_named<transports::gige::Fault>(section.kind);
    if (!fault)
        throw ConfigError(
            fmt::format("{}: gige.faults: no fault \"{}\"", config.source.string(), section.kind));
    rule.fault = *fault;
    rule.percent = section.percent;
    rule.first_frame = section.first;
    rule.last_frame = section.last;
    rule.every_frames = section.every;
    rule.burst = section.burst_packets;
    rule.amount = section.amount;
    rule.seed = section.seed;
    return rule;
}

TransportPtr make_gige(const emulator::DaemonConfig& config, CameraControl& control, const Clock& clock,
                       const ThreadPlan& threads) {
    if (!config.gige.enabled) return nullptr;
    transports::gige::GigeSettings settings;
    settings.interface = config.gige.interface;
    settings.port = config.gige.port;
    settings.vendor = config.gige.vendor;
    settings.model = config.gige.model;
    settings.serial = config.gige.serial;
    settings.user_name = config.gige.user_name;
    settings.mac = config.gige.mac;
    settings.packet_size = config.gige.packet_size;
    settings.heartbeat_timeout_ms = config.gige.heartbeat_timeout_ms;
    settings.history_frames = config.gige.history_frames;
    settings.drop_percent = config.gige.drop_percent;
    settings.throughput_limit_mbit_s = config.gige.throughput_limit_mbit_s;
    settings.backend = enum_named<transports::gige::SendBackend>(config.gige.backend).value();
    settings.allow = config.gige.allow;
    settings.off_link = config.gige.off_link;
    settings.read_only = config.gige.read_only;
    settings.state_file = config.gige.state_file;
    settings.xml = config.gige.xml;
    settings.xml_values = config.gige.xml_values;
    for (const emulator::FaultSection& section : config.gige.faults)
        settings.faults.push_back(fault_rule(config, section));
    return std::make_unique<transports::gige::GigeCamera>(
        settings, control, clock,
        transports::gige::GigeContext{.thread = threads.transmit, .seed = config.daemon.seed});
}

TransportPtr make_file(const emulator::DaemonConfig& config, CameraControl& /*control*/,
                       const Clock& /*clock*/, const ThreadPlan& /*threads*/) {
    if (!config.file.enabled) return nullptr;
    const std::filesystem::path directory = config.file.directory;
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    if (error)
        throw OutputError(fmt::format("{}: file.directory: cannot make {}: {}", config.source.string(),
                                      directory.string(), error.message()));
    return std::make_unique<transports::FileSink>(
        transports::FileSinkSettings{.directory = directory,
                                     .format = enum_named<images::FrameFormat>(config.file.format).value(),
                                     .queue_frames = static_cast<std::size_t>(config.file.queue_frames),
                                     .truth = config.file.truth});
}

TransportPtr make_v4l2(const emulator::DaemonConfig& config, CameraControl& control, const Clock& /*clock*/,
                       const ThreadPlan& threads) {
    if (!config.v4l2.enabled) return nullptr;
    transports::V4l2Settings settings;
    settings.device = config.v4l2.device;
    settings.format = enum_named<transports::V4l2Format>(config.v4l2.format).value();
    settings.io = enum_named<transports::V4l2Io>(config.v4l2.io).value();
    const CameraSettings camera = control.settings();
    transports::V4l2Context context;
    context.width = composed_size(camera).width;
    context.height = composed_size(camera).height;
    context.bits_per_pixel = config.sensor.detector.adc_bits;
    context.frame_rate_hz = camera.frame_trigger.enabled ? config.trigger.rate_hz : camera.frame_rate_hz;
    settings.frame_counter = config.v4l2.frame_counter;
    settings.required = config.v4l2.required;
    settings.buffers = config.v4l2.buffers;
    settings.queue_frames = static_cast<std::size_t>(config.v4l2.queue_frames);
    context.thread = threads.display;
    return std::make_unique<transports::V4l2Output>(settings, context);
}

TransportPtr make_stimulator(const emulator::DaemonConfig& config, CameraControl& /*control*/,
                             const Clock& /*clock*/, const ThreadPlan& threads) {
    const emulator::StimulatorSection& section = config.stimulator;
    if (!section.enabled) return nullptr;
    transports::StimulatorSettings settings;
    settings.vendor_id = section.vendor_id;
    settings.product_id = section.product_id;
    settings.serial = section.serial;
    settings.width = section.width;
    settings.height = section.height;
    settings.refresh_hz = section.refresh_hz;
    settings.format = enum_named<transports::DisplayFormat>(section.format).value();
    settings.grey = enum_named<transports::GreyCoding>(section.grey).value();
    settings.compression = enum_named<transports::Compression>(section.compression).value();
    settings.dither = enum_named<transports::Dither>(section.dither).value();
    settings.queue_frames = static_cast<std::size_t>(section.queue_frames);
    settings.calibration = section.calibration;
    settings.black_dn = section.black_dn;
    settings.white_dn = section.white_dn;
    settings.peak = section.peak;
    const transports::SensorFacts sensor{config.sensor.readout.width, config.sensor.readout.height,
                                         config.sensor.detector.adc_bits};
    return std::make_unique<transports::StimulatorOutput>(
        settings, transports::StimulatorContext{.sensor = sensor, .thread = threads.display},
        transports::make_libusb_bus());
}

// One line for each kind of transport.
constexpr TransportPtr (*makers[])(const emulator::DaemonConfig&, CameraControl&, const Clock&,
                                   const ThreadPlan&) = {
    make_file,
    make_gige,
    make_v4l2,
    make_stimulator,
};

} // namespace

std::vector<TransportPtr> make_transports(const emulator::DaemonConfig& config, CameraControl& control,
                                          const Clock& clock, const ThreadPlan& threads) {
    std::vector<TransportPtr> made;
    for (const auto make : makers)
        if (TransportPtr transport = make(config, control, clock, threads))
            made.push_back(std::move(transport));
    return made;
}

std::size_t frames_needed(const emulator::DaemonConfig& config) {
    std::size_t frames = Releaser::frames_in_flight + 1;
    ++frames; // the last one, under deadline.policy "repeat", which may be chosen while running
    if (config.gige.enabled) frames += static_cast<std::size_t>(config.gige.history_frames) + 2;
    if (config.file.enabled) frames += static_cast<std::size_t>(config.file.queue_frames);
    if (config.stimulator.enabled) frames += static_cast<std::size_t>(config.stimulator.queue_frames) + 1;
    if (config.v4l2.enabled) frames += static_cast<std::size_t>(config.v4l2.queue_frames);
    return frames;
}

} // namespace obscura::emulator
