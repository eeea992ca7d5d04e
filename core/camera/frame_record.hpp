// SPDX-License-Identifier: Apache-2.0
// Frame record: tables of all that is stated of a frame in chunks, cards, the timing file and JSON.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/frame_quality.hpp"
#include "core/camera/record_field.hpp"
#include "core/camera/scene_truth.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace obscura {

/// Chunks in the order of ChunkSelector and of the payload; the value is the bit in a selection. Instants in
/// chunks are device time in ns. Lists have a head, u32 count and u32 0, except where stated.
enum class Chunk : std::uint8_t {
    timestamp,
    exposure_time,
    gain,
    frame_id,
    width,
    height,
    offset_x,
    offset_y,
    pixel_format,
    trigger_id,
    frame_flags,
    regions,      ///< list of max_windows FrameWindow
    row_times,    ///< list of a RowTime for each row
    ground_truth, ///< GroundTruth, with max_truth_bodies BodyTruth and BodyAge within
    line_status_all,
    sequencer_set_active,
    region_id, ///< u32 count, then max_windows u32: region number of each window in the image
    /// u32 count, u32 further entries that found no room, then as many TruthEntry as the camera sends at most
    truth_table,
    frame_quality, ///< FrameQuality
};
constexpr std::size_t chunk_count = 19;
/// Names of ChunkSelector.
constexpr auto enum_names(Chunk /*type*/) {
    return std::array{EnumName{Chunk::timestamp, "Timestamp"},
                      EnumName{Chunk::exposure_time, "ExposureTime"},
                      EnumName{Chunk::gain, "Gain"},
                      EnumName{Chunk::frame_id, "FrameID"},
                      EnumName{Chunk::width, "Width"},
                      EnumName{Chunk::height, "Height"},
                      EnumName{Chunk::offset_x, "OffsetX"},
                      EnumName{Chunk::offset_y, "OffsetY"},
                      EnumName{Chunk::pixel_format, "PixelFormat"},
                      EnumName{Chunk::trigger_id, "TriggerID"},
                      EnumName{Chunk::frame_flags, "FrameFlags"},
                      EnumName{Chunk::regions, "Regions"},
                      EnumName{Chunk::row_times, "RowTimes"},
                      EnumName{Chunk::ground_truth, "GroundTruth"},
                      EnumName{Chunk::line_status_all, "LineStatusAll"},
                      EnumName{Chunk::sequencer_set_active, "SequencerSetActive"},
                      EnumName{Chunk::region_id, "RegionID"},
                      EnumName{Chunk::truth_table, "TruthTable"},
                      EnumName{Chunk::frame_quality, "FrameQuality"}};
}
static_assert(enum_names(Chunk{}).size() == chunk_count);

/// Values of a frame that have a chunk of their own, in the order of their features.
struct FrameHead {
    std::uint64_t timestamp_ns = 0; ///< trigger edge
    double exposure_us = 0;         ///< as requested
    double gain_db = 0;
    std::uint64_t frame_id = 0, trigger_id = 0;
    Region image; ///< OffsetX, OffsetY, Width, Height
    std::uint32_t pixel_format = 0;
    std::uint32_t flags = 0; ///< FrameFlag bits and the state of the trigger's clock (reported_flags())
    std::uint32_t line_status = 0, sequencer_set = 0;
};

/// What calls and the web server tell of a frame, besides its pixels and its place in a series.
struct FrameAnswer {
    std::uint64_t frame = 0, trigger = 0;
    std::int64_t edge_tai_ns = 0;
    double exposure_us = 0, gain_db = 0;
    std::uint32_t bits = 0;
    std::int64_t mid_exposure_tai_ns = 0;
    std::array<double, 3> camera_position_m{};  ///< at mid-exposure, inertial
    std::array<double, 4> camera_orientation{}; ///< scalar first, from camera to inertial axes
};
[[nodiscard]] FrameAnswer answer_of(const FrameInfo& info) noexcept;

/// Age of a body's pose: apart from BodyTruth, because it came into the chunk later.
struct BodyAge {
    double pose_age_s = 0;
};

/// Numbers of one frame in the timing file. Instants in ns of the scheduling clock, 0 if the frame did not
/// reach that stage.
struct FrameRecord {
    std::uint64_t frame_id = 0, trigger_id = 0;
    std::int64_t edge = 0, seen = 0, pose = 0, render_begin = 0, render_end = 0, detector_end = 0;
    std::int64_t due = 0, first = 0, last_due = 0, last = 0; ///< release of the first and last row
    std::int64_t rows = 0, late_rows = 0, stalled_rows = 0;  ///< see emulator::ReleaseCounters
    std::int64_t worst_row = 0, worst_row_number = 0;        ///< lateness of the latest row
    std::int64_t flags = 0;                                  ///< FrameFlag
    std::int64_t acquisition = 0;                            ///< from 1
    std::int64_t min_period = 0;                             ///< of the chip, from one frame to the next
    std::int64_t width = 0, height = 0;
    std::int64_t render_threads = 0, render_cores = 0;
    std::int64_t samples_per_pixel = 0, max_instants = 0; ///< settings
    double target_error = 0;                              ///< setting
    /// Parts of rendering, sums over the render threads in ns; see renderer::RenderPart.
    std::int64_t setup = 0, sampling = 0, grid = 0, wings = 0, points = 0, rest = 0;
    std::int64_t measured = 0, measured_cpu = 0, preemptions = 0, page_faults = 0; ///< renderer::RenderWork
    std::int64_t rendered_rows = 0, row_instants = 0; ///< rows, and the sum of their instants
    std::int64_t samples = 0, rays = 0;
    std::int64_t detector_wait = 0, detector = 0, ahead = 0; ///< see emulator::FrameWork
    double ahead_error_px = 0;                               ///< see emulator::FrameWork
    FrameQuality quality;
};

/// Fields of a frame's values: FrameHead, FrameAnswer, FrameWindow, RowTime, GroundTruth, BodyTruth, BodyAge,
/// TruthEntry, FrameQuality, and FrameRecord, whose quality stands in FrameQuality. In the order of features
/// and members. Static storage.
template<typename Owner>
[[nodiscard]] std::span<const RecordField<Owner>> record_fields() noexcept;
template<>
std::span<const RecordField<FrameHead>> record_fields() noexcept;
template<>
std::span<const RecordField<FrameAnswer>> record_fields() noexcept;
template<>
std::span<const RecordField<FrameWindow>> record_fields() noexcept;
template<>
std::span<const RecordField<RowTime>> record_fields() noexcept;
template<>
std::span<const RecordField<GroundTruth>> record_fields() noexcept;
template<>
std::span<const RecordField<BodyTruth>> record_fields() noexcept;
template<>
std::span<const RecordField<BodyAge>> record_fields() noexcept;
template<>
std::span<const RecordField<TruthEntry>> record_fields() noexcept;
template<>
std::span<const RecordField<FrameQuality>> record_fields() noexcept;
template<>
std::span<const RecordField<FrameRecord>> record_fields() noexcept;

/// The two parts of the fields of FrameQuality: levels and errors of rendering; what terrains lacked.
[[nodiscard]] std::span<const RecordField<FrameQuality>> level_fields() noexcept;
[[nodiscard]] std::span<const RecordField<FrameQuality>> terrain_fields() noexcept;

/// Bytes of a record, or of an item of a list, in its chunk.
template<typename Owner>
[[nodiscard]] std::size_t record_bytes() noexcept {
    return record_bytes<Owner>(record_fields<Owner>());
}
/// The chunk of a field of FrameHead.
[[nodiscard]] Chunk chunk_of(const RecordField<FrameHead>& field) noexcept;
/// The field whose chunk it is; null for chunks of other values.
[[nodiscard]] const RecordField<FrameHead>* head_field(Chunk chunk) noexcept;

constexpr std::size_t list_head_bytes = 8;
/// Where the lists in the chunk of the ground truth begin.
constexpr std::size_t truth_bodies_offset = 0x68, truth_ages_offset = 0x620;

/// Column of the timing file: a whole number. Units stand in the name.
struct TimingColumn {
    std::string_view name;
    bool is_instant = false;     ///< 0: the frame does not have it
    bool in_first_files = false; ///< else files of older versions may lack it
    const RecordField<FrameRecord>* field = nullptr;
    const RecordField<FrameQuality>* quality = nullptr; ///< either this or `field`

    [[nodiscard]] std::int64_t value(const FrameRecord& frame) const;
    void set(FrameRecord& frame, std::int64_t value) const;
};
/// In the order of the file. Static storage.
[[nodiscard]] std::span<const TimingColumn> timing_columns();

/// Millionths, as the timing file has errors and shares.
[[nodiscard]] std::int64_t in_millionths(double value) noexcept;
[[nodiscard]] inline std::int64_t in_millionths(float value) noexcept {
    return in_millionths(static_cast<double>(value));
}

} // namespace obscura
