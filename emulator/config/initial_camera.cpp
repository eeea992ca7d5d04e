// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/initial_camera.hpp"

#include "core/camera/setting_table.hpp"
#include "sync/settings.hpp"

#include <algorithm>
#include <optional>

namespace obscura::emulator {
namespace {

/// `chosen`, or else all edges that the line reports.
TriggerActivation activation_of(const std::optional<TriggerActivation>& chosen, const LineEdges& edges) {
    if (chosen) return *chosen;
    if (edges.both()) return TriggerActivation::any_edge;
    return edges.falling ? TriggerActivation::falling_edge : TriggerActivation::rising_edge;
}

} // namespace

CameraLimits camera_limits(const SensorDescription& sensor, std::int32_t rows_max) {
    CameraLimits limits;
    limits.sensor_width = sensor.readout.width;
    limits.sensor_height = sensor.readout.height;
    limits.pixel_width_m = sensor.pixel_pitch_m;
    limits.pixel_height_m = sensor.row_pitch_m();
    limits.windows_max = static_cast<std::uint32_t>(sensor.readout.windows_max);
    limits.rows_max = std::max(rows_max, sensor.readout.height);
    limits.strict = sensor.readout.strict;
    if (sensor.readout.exposure_max_ns > 0)
        limits.exposure_max_ns = std::min(limits.exposure_max_ns, sensor.readout.exposure_max_ns);
    limits.adc_bits = sensor.detector.adc_bits;
    limits.black_level_max_dn = max_black_level_dn(sensor.detector.adc_bits);
    limits.black_level_min_dn = std::min(0.0, sensor.detector.offset_dn);
    limits.temperature_c = sensor.detector.temperature_c;
    limits.overlapped = sensor.readout.overlapped;
    limits.global_shutter = sensor.readout.shutter == Shutter::global;
    limits.sensor_name = sensor.name;
    return limits;
}

std::size_t initial_trigger_line(const DaemonConfig& config) {
    const std::size_t line = line_of(config.camera.settings.frame_trigger.source);
    return line < line_count ? line : 0;
}

InitialCamera initial_camera(const DaemonConfig& config) {
    InitialCamera camera;
    CameraSettings& settings = camera.settings;
    CameraLimits& limits = camera.limits;
    settings = camera_settings(config);
    limits = camera_limits(config.sensor, std::max(config.camera.rows_max, composed_size(settings).height));
    for (std::size_t i = 0; i < line_count; ++i)
        limits.lines[i] = sync::reported_edges(config.trigger, i);
    settings.frame_trigger.activation =
        activation_of(config.camera.trigger_activation, limits.lines[initial_trigger_line(config)]);
    for (TriggerChoice* other :
         {&settings.start_trigger, &settings.burst_trigger, &settings.exposure_trigger})
        other->activation = activation_of(std::nullopt, limits.lines[0]);
    settings.trigger_overlap = config.trigger.over_trigger == sync::OverTrigger::latch
                                   ? TriggerOverlap::previous_frame
                               : limits.overlapped ? TriggerOverlap::readout
                                                   : TriggerOverlap::off;
    return camera;
}

} // namespace obscura::emulator
