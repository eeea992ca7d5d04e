// SPDX-License-Identifier: Apache-2.0
// Counters of a camera, and the table of its metrics: state, Prometheus, status page and telemetry are made
// from it.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "core/metric.hpp"
#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace obscura {

/// Why an edge produced no frame.
enum class MissedReason : std::uint8_t {
    lost_edge,  ///< the source or the way from it lost the edge: a gap in its numbers
    chip_busy,  ///< the sensor would not have been ready either: exposure, readout or a burst in progress
    rendering,  ///< the sensor would have been ready, but the frame before was still being made
    latch_full, ///< OverTrigger::latch: one edge waited already
    stopped,    ///< OverTrigger::latch: the acquisition ended while it waited
};
constexpr auto enum_names(MissedReason /*type*/) {
    using R = MissedReason;
    return std::array{EnumName{R::lost_edge, "lost_edge"}, EnumName{R::chip_busy, "chip_busy"},
                      EnumName{R::rendering, "rendering"}, EnumName{R::latch_full, "latch_full"},
                      EnumName{R::stopped, "stopped"}};
}
inline constexpr std::size_t missed_reason_count = enum_names(MissedReason{}).size();
/// Missed edges by MissedReason.
using MissedCounts = std::array<std::uint64_t, missed_reason_count>;

/// Frames whose terrains or giant textures were coarser than asked for, and those with doubtful rays to
/// shapes of users.
struct LodCounters {
    std::uint64_t frames = 0, tiles_missing = 0;
    std::uint64_t doubtful_frames = 0;
};

/// Outcomes of rendering ahead since construction: each frame begun is later used or discarded.
struct AheadCounters {
    std::uint64_t begun = 0;     ///< frames whose rendering began before their trigger
    std::uint64_t used = 0;      ///< confirmed by the trigger
    std::uint64_t discarded = 0; ///< other settings, another instant, or the trigger never came
    std::uint64_t early = 0;     ///< of `used`: all rows were ready at the trigger
    std::uint64_t moved = 0;     ///< of `used`: rows were reprojected to the true edge and poses
};

/// Quality of the frames since construction.
struct QualityCounters {
    std::uint64_t degraded = 0;                             ///< frames with a row below QualityLevel::full
    std::uint64_t failed = 0;                               ///< of those: their error is above the floor
    std::array<std::uint64_t, quality_level_count> worst{}; ///< frames by the worst level of their rows

    // The last frame rendered; from two consecutive ones if it is read meanwhile.
    QualityLevel last_level = QualityLevel::full;
    std::uint32_t last_reasons = 0;
    std::int32_t last_rows_degraded = 0;
    float last_error = 0;
    std::int64_t last_margin_us = 0;
};

/// Counters since construction. Each edge that arrives while acquiring, from the selected source, counts in
/// `triggers`, and then in exactly one of `frames`, `missed_triggers`, `masked_triggers` and `dropped`,
/// except while its frame is in progress or it waits latched.
struct CameraCounters {
    std::uint64_t triggers = 0;         ///< edges, including lost ones (gaps in the source's ids)
    std::uint64_t missed_triggers = 0;  ///< lost edges, and edges before the camera was ready again
    MissedCounts missed_because{};      ///< their reasons
    std::uint64_t masked_triggers = 0;  ///< edges before the camera was ready, under OverTrigger::ignore
    std::uint64_t latched_triggers = 0; ///< edges that became frames after waiting for the camera
    std::uint64_t ignored = 0;          ///< edges while not acquiring, or from a source not selected
    std::uint64_t dropped = 0;          ///< pool empty, or no transport took the frame
    LodCounters lod;                    ///< frames with tiles missing
    std::uint64_t frames = 0;           ///< frames passed to at least one transport
    /// Frames of `frames` that viewers alone have taken: each transport for receivers refused them, because
    /// it has none, or no room.
    std::uint64_t unsent = 0;
    std::uint64_t complete = 0; ///< frames with all rows released
    std::uint64_t late = 0;     ///< complete frames with rows that were not ready in time
    std::uint64_t late_rows = 0;
    std::uint64_t stalled = 0, stalled_rows = 0; ///< see emulator::ReleaseCounters
    std::uint64_t failed = 0;          ///< frames with rows that could not be rendered, frame_failed
    std::uint64_t poses_held = 0;      ///< frames that show a pose of another time, frame_pose_held
    std::uint64_t values_replaced = 0; ///< see sensors::Detector::values_replaced()
    std::uint64_t abandoned = 0;       ///< frames with rows missing: aborted, or abandoned as too late
    std::uint64_t repeated = 0;        ///< LatePolicy::repeat
    std::uint64_t late_dropped = 0;    ///< LatePolicy::drop
    std::uint64_t partial = 0;         ///< LatePolicy::partial
    AheadCounters ahead;               ///< frames rendered before their trigger
    QualityCounters quality;           ///< frames rendered below full quality to be in time
};

/// Counters of the port for simulators.
struct SimulatorCounters {
    std::uint64_t connections = 0, poses = 0, steps = 0;
    std::uint64_t refused = 0; ///< lines and connections refused
};

/// Rows of CameraCounters, in the order of the state.
inline constexpr auto camera_metrics = [] {
    using C = CameraCounters;
    using A = AheadCounters;
    using Q = QualityCounters;
    constexpr std::string_view root = "camera", ahead = "camera/ahead", quality = "camera/quality";
    const std::array head{
        counter<&C::triggers>(root, "triggers")
            .as_counter("triggers_seen_total", "Trigger edges while acquiring, that in progress included.")
            .on_status(0, "triggers")
            .in_telemetry(0, "TRIGGERS", "Trigger edges since the daemon's start"),
        counter<&C::frames>(root, "frames")
            .as_counter("triggers_total", "Trigger edges while acquiring, by what became of them.", "outcome",
                        "frame")
            .on_status(1, "frames")
            .in_telemetry(1, "FRAMES", "Frames that were begun"),
        counter<&C::complete>(root, "complete")
            .as_counter("frames_total", "Frames, by what became of them.", "outcome", "complete")
            .on_status(2, "complete")
            .in_telemetry(2, "COMPLETE", "Frames that came to their end"),
        counter<&C::late>(root, "late")
            .as_counter("frames_late_total", "Complete frames with rows that were not ready in time.")
            .on_status(3, "late")
            .in_telemetry(3, "LATE", "Frames with rows that were not ready in time"),
        counter<&C::late_rows>(root, "late_rows")
            .as_counter("rows_late_total", "Rows that were not ready in time.")
            .in_telemetry(4, "LATE_ROWS", "Those rows"),
        counter<&C::stalled>(root, "stalled")
            .as_counter("frames_stalled_total",
                        "Frames with rows that were ready in time and left more than a millisecond late."),
        counter<&C::stalled_rows>(root, "stalled_rows")
            .as_counter("rows_stalled_total",
                        "Rows that were ready in time and left more than a millisecond late.")
            .in_telemetry(5, "STALLED_ROWS", "Rows that were ready and left more than a millisecond late"),
        counter<&C::failed>(root, "failed")
            .as_counter("frames_render_failed_total",
                        "Frames with rows that could not be rendered, which are black."),
        counter<&C::poses_held>(root, "poses_held")
            .as_counter(
                "frames_pose_held_total",
                "Frames that show the last known pose of something whose pose is not known for their time."),
        counter<&C::missed_triggers>(root, "missed_triggers")
            .as_counter("triggers_total", "", "outcome", "missed")
            .on_status(4, "missed triggers")
            .in_telemetry(6, "MISSED", "Triggers that made no frame"),
    };
    const std::array tail{
        counter<&C::ignored>(root, "ignored")
            .as_counter("triggers_ignored_total",
                        "Trigger edges while not acquiring, or from a source that is not selected."),
        counter<&C::lod, &LodCounters::frames>("camera/lod_deficit", "frames")
            .as_counter("frames_tiles_missing_total",
                        "Frames with coarser cells of terrain than asked for, because tiles were missing."),
        counter<&C::lod, &LodCounters::tiles_missing>("camera/lod_deficit", "tiles_missing"),
        counter<&C::lod, &LodCounters::doubtful_frames>(root, "doubtful_frames")
            .as_counter("frames_rays_doubtful_total",
                        "Frames with rays to shapes in SuMoL of which it is not sure what they hit."),
        counter<&C::dropped>(root, "dropped")
            .as_counter("triggers_total", "", "outcome", "dropped")
            .on_status(6, "dropped")
            .in_telemetry(8, "DROPPED", "Triggers for which there was no buffer"),
        counter<&C::unsent>(root, "unsent")
            .as_counter(
                "frames_unsent_total",
                "Frames that no transport took: none had a receiver, or room. Viewers may have seen them."),
        counter<&C::abandoned>(root, "abandoned")
            .as_counter("frames_total", "", "outcome", "abandoned")
            .on_status(5, "abandoned")
            .in_telemetry(7, "ABANDONED", "Frames that were begun and not finished"),
        counter<&C::masked_triggers>(root, "masked_triggers")
            .as_counter("triggers_total", "", "outcome", "masked"),
        counter<&C::latched_triggers>(root, "latched_triggers")
            .as_counter("triggers_latched_total", "Trigger edges that waited for the camera."),
        counter<&C::repeated>(root, "repeated")
            .as_counter("frames_repeated_total", "Late frames replaced by the one before."),
        counter<&C::late_dropped>(root, "late_dropped")
            .as_counter("frames_late_dropped_total", "Late frames that were not sent."),
        counter<&C::partial>(root, "partial").as_counter("frames_partial_total", "Late frames ended early."),
        counter<&C::ahead, &A::begun>(ahead, "begun"),
        counter<&C::ahead, &A::used>(ahead, "used"),
        counter<&C::ahead, &A::early>(ahead, "early"),
        counter<&C::ahead, &A::moved>(ahead, "reprojected"),
        counter<&C::ahead, &A::discarded>(ahead, "discarded"),
        counter<&C::values_replaced>(root, "sensor_values_replaced")
            .as_counter(
                "sensor_values_replaced_total",
                "Values of the sensor's model that were not numbers, or out of range, and were replaced."),
        counter<&C::quality, &Q::degraded>(quality, "degraded")
            .as_counter("frames_degraded_total", "Frames rendered below full quality to be in time.")
            .on_status(7, "degraded"),
        counter<&C::quality, &Q::failed>(quality, "failed"),
    };
    std::array<CounterMetric<C>, head.size() + missed_reason_count + tail.size() + quality_level_count> all{};
    std::size_t n = 0;
    for (const auto& row : head)
        all[n++] = row;
    for (std::size_t i = 0; i < missed_reason_count; ++i) {
        const std::string_view reason = enum_names(MissedReason{})[i].name;
        all[n++] = counter<&C::missed_because>("camera/missed_because", reason, i)
                       .as_counter("triggers_missed_total", i == 0 ? "Missed trigger edges, by reason." : "",
                                   "reason", reason);
    }
    for (const auto& row : tail)
        all[n++] = row;
    for (std::size_t i = 0; i < quality_level_count; ++i)
        all[n++] = counter<&C::quality, &Q::worst>(quality, enum_names(QualityLevel{})[i].name, i);
    return all;
}();

/// Rows of SimulatorCounters, in the order of the state.
inline constexpr auto simulator_metrics = [] {
    using S = SimulatorCounters;
    constexpr std::string_view root = "simulator", lines = "simulator_lines_total";
    return std::array{
        counter<&S::connections>(root, "connections")
            .as_counter("simulator_connections_total", "Connections to the simulator port."),
        counter<&S::poses>(root, "poses")
            .as_counter(lines,
                        "Lines to the simulator port, by what they were; those refused with connections.",
                        "kind", "pose"),
        counter<&S::steps>(root, "steps").as_counter(lines, "", "kind", "step"),
        counter<&S::refused>(root, "refused").as_counter(lines, "", "kind", "refused"),
    };
}();

/// What else the state tells of a camera.
inline constexpr std::array camera_state_metrics{
    Metric{"trigger", "refused"}.as_counter("triggers_refused_total",
                                            "Malformed messages from the trigger source."),
    Metric{"", "acquiring"}.as_gauge("acquiring", "1 while the acquisition runs."),
    Metric{"", "trigger_ready"}.as_gauge("trigger_ready", "1 while a trigger would be accepted."),
    Metric{"last_frame", "age_s"}.as_gauge(
        "frame_age_seconds",
        "Time since the last complete frame of this acquisition, to a tenth of a second; "
        "not where frames come on request."),
    Metric{"last_frame", "overdue_s"}.as_gauge(
        "frame_overdue_seconds",
        "Age from which the next frame is overdue: three times the longest gap of the last minute, 2 s at least."),
    Metric{"", "frame_id"}.as_gauge("last_frame_id", "Number of the last frame."),
};

/// Counters of the GigE transport that have families of their own.
inline constexpr auto gige_metrics = [] {
    constexpr std::string_view root = "transports/gige", packets = "gige_packets_total";
    return std::array{
        Metric{root, "packets"}.as_counter(packets, "Stream packets; those sent include those sent again.",
                                           "kind", "sent"),
        Metric{root, "resent_packets"}.as_counter(packets, "", "kind", "resent"),
        Metric{root, "injected_losses"}.as_counter(packets, "", "kind", "withheld"),
        Metric{root, "send_errors"}.as_counter(packets, "", "kind", "error"),
        Metric{root, "resend_requests"}.as_counter("gige_resend_requests_total",
                                                   "Requests of clients for packets once more."),
        Metric{root, "control_taken"}.as_counter("gige_control_taken_total",
                                                 "Times that a client took control of the camera."),
        Metric{root, "control_lost"}.as_counter(
            "gige_control_lost_total", "Clients that lost control because they had been silent too long."),
    };
}();

/// Histograms of a camera, in microseconds; in seconds for Prometheus.
inline constexpr std::array latency_metrics{
    Metric{"latency_us", "trigger_to_first_row"}.as_histogram(
        "trigger_to_first_row_seconds", "From the trigger edge to the release of the first row."),
    Metric{"latency_us", "trigger_to_last_row"}.as_histogram(
        "trigger_to_last_row_seconds", "From the trigger edge to the release of the last row."),
    Metric{"latency_us", "release_lateness"}.as_histogram(
        "release_lateness_seconds", "From the time of a row that was ready to its release."),
    Metric{"stages_us", "trigger_seen"}.as_histogram("trigger_seen_seconds",
                                                     "From the trigger edge until the camera has seen it."),
    Metric{"stages_us", "render"}.as_histogram("render_seconds",
                                               "Of the renderer, from the first to the last row of a frame."),
    Metric{"stages_us", "detector"}.as_histogram(
        "detector_seconds", "From the last rendered row until the detector has made the last one."),
};

} // namespace obscura
