// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame_record.hpp"

#include <cmath>
#include <vector>

namespace obscura {
namespace {

template<typename Owner, std::size_t n>
using Fields = std::array<RecordField<Owner>, n>;

constexpr std::array head_fields{
    field<&FrameHead::timestamp_ns>("timestamp_ns").at(0).as_sfnc("ChunkTimestamp").in("ns"),
    field<&FrameHead::exposure_us>("exposure_us").at(0).as_sfnc("ChunkExposureTime").in("us"),
    field<&FrameHead::gain_db>("gain_db").at(0).as_sfnc("ChunkGain").in("dB"),
    field<&FrameHead::frame_id>("frame_id").at(0).as_sfnc("ChunkFrameID"),
    field<&FrameHead::image, &Region::width>("width").at(0).as_sfnc("ChunkWidth"),
    field<&FrameHead::image, &Region::height>("height").at(0).as_sfnc("ChunkHeight"),
    field<&FrameHead::image, &Region::x>("offset_x").at(0).as_sfnc("ChunkOffsetX"),
    field<&FrameHead::image, &Region::y>("offset_y").at(0).as_sfnc("ChunkOffsetY"),
    field<&FrameHead::pixel_format>("pixel_format").at(0).as_sfnc("ChunkPixelFormat"),
    field<&FrameHead::trigger_id>("trigger_id").at(0).as_feature("ChunkTriggerID"),
    field<&FrameHead::flags>("flags").at(0).as_feature(
        "ChunkFrameFlags",
        "1 late, 2 repeated, 4 partial, 8 dropped, 16 readout clamped, 32 image lag of the frame before missing, 64 degraded, 128 biased, 1024 stalled"),
    field<&FrameHead::line_status>("line_status")
        .at(0)
        .as_sfnc("ChunkLineStatusAll", "At the edge of the trigger; inputs only"),
    field<&FrameHead::sequencer_set>("sequencer_set").at(0).as_sfnc("ChunkSequencerSetActive"),
};
/// In the order of `head_fields`.
constexpr std::array head_chunks{Chunk::timestamp,
                                 Chunk::exposure_time,
                                 Chunk::gain,
                                 Chunk::frame_id,
                                 Chunk::width,
                                 Chunk::height,
                                 Chunk::offset_x,
                                 Chunk::offset_y,
                                 Chunk::pixel_format,
                                 Chunk::trigger_id,
                                 Chunk::frame_flags,
                                 Chunk::line_status_all,
                                 Chunk::sequencer_set_active};
static_assert(head_fields.size() == head_chunks.size());

constexpr std::array window_fields{
    field<&FrameWindow::sensor, &Region::x>("x")
        .at(0x00)
        .as_feature("ChunkRegionOffsetX")
        .as_card("X", "[px] first sensor column of the window")
        .as_member(),
    field<&FrameWindow::sensor, &Region::y>("y")
        .at(0x04)
        .as_feature("ChunkRegionOffsetY")
        .as_card("Y", "[px] first sensor row")
        .as_member(),
    field<&FrameWindow::sensor, &Region::width>("width")
        .at(0x08)
        .as_feature("ChunkRegionWidth")
        .as_card("NX", "[px] columns")
        .as_member(),
    field<&FrameWindow::sensor, &Region::height>("height")
        .at(0x0c)
        .as_feature("ChunkRegionHeight")
        .as_card("NY", "[px] rows")
        .as_member(),
    field<&FrameWindow::image_y>("image_y")
        .at(0x10)
        .as_feature("ChunkRegionImageY")
        .as_card("ROW", "[px] its first row in the image")
        .as_member(),
    field<&FrameWindow::flags>("flags").at(0x14).as_feature("ChunkRegionFlags").as_member(),
    field<&FrameWindow::exposure_requested_ns>("exposure_requested_ns")
        .at(0x18)
        .as_feature("ChunkRegionExposureTime")
        .in("ns")
        .as_card("TASK", "[ns] integration time asked for")
        .as_member(),
    field<&FrameWindow::exposure_min_ns>("exposure_min_ns")
        .at(0x20)
        .as_feature("ChunkRegionExposureTimeMin", "Shortest obtained over the rows")
        .in("ns")
        .as_card("TMIN", "[ns] obtained, least of its rows")
        .as_member(),
    field<&FrameWindow::exposure_max_ns>("exposure_max_ns")
        .at(0x28)
        .as_feature("ChunkRegionExposureTimeMax", "Longest obtained over the rows")
        .in("ns")
        .as_card("TMAX", "[ns] obtained, most of its rows")
        .as_member(),
};

constexpr std::array row_fields{
    field<&RowTime::reset>("reset_ns").at(0x00).as_feature("ChunkRowReset").in("ns"),
    field<&RowTime::read>("read_ns").at(0x08).as_feature("ChunkRowRead").in("ns"),
};

using Q = FrameQuality;
constexpr std::array quality_fields{
    field<&Q::level_max>("level_max")
        .at(0x000)
        .as_feature(
            "ChunkQualityLevel",
            "Worst level of a group of rows: 0 full, 1 goal, 2 instants, 3 bounces, 4 grid, 5 quarter, 6 sixteenth, 7 reprojected, 8 repeated, 9 missing")
        .as_card("QLEVEL", "worst quality level of a group of rows")
        .as_member("level")
        .as_column(43),
    field<&Q::reasons>("reasons")
        .at(0x004)
        .as_feature("ChunkQualityReasons",
                    "1 too little time, 2 other programs, 4 predicted cost, 8 page faults, 16 unknown scene")
        .as_card("QREASON", "why not full, bits")
        .as_member()
        .as_column(45, "quality_reasons"),
    field<&Q::groups>("groups").at(0x008),
    field<&Q::group_rows>("group_rows").at(0x00c).as_member(),
    field<&Q::group_level>("group_level").at(0x0c8).as_member("group_levels").with_used([](const Q& q) {
        return std::size_t{q.groups};
    }),
    field<&Q::rows_degraded>("rows_degraded")
        .at(0x018)
        .as_feature("ChunkQualityRowsDegraded", "Rows of levels other than full")
        .as_card("QROWDEG", "rows of levels other than full")
        .as_member()
        .as_column(44),
    field<&Q::error_rms>("error_rms")
        .at(0x020)
        .as_feature("ChunkQualityError",
                    "Error of rendering over the lit pixels, over their root mean square; 0: not estimated")
        .as_card("QERRRMS", "error over rms of the lit pixels")
        .as_member("error")
        .as_column(46, "error_ppm", 1e6),
    field<&Q::error_worst_group>("error_worst_group")
        .at(0x028)
        .as_feature("ChunkQualityErrorWorst", "As ChunkQualityError, of the worst group of rows")
        .as_card("QERRWRST", "the same, of the worst group of rows")
        .as_member()
        .as_column(50, "error_worst_ppm", 1e6),
    field<&Q::error_goal>("error_goal")
        .at(0x1d8)
        .as_feature("ChunkQualityErrorGoal",
                    "Error that the settings ask of each pixel (render.target_error); 0: none")
        .as_card("QERRGOAL", "error that the settings ask of each pixel")
        .as_member()
        .as_column(51, "error_goal_ppm", 1e6),
    field<&Q::noise_ratio_p95>("noise_ratio_p95")
        .at(0x1e0)
        .as_feature(
            "ChunkQualityNoiseRatio",
            "Error of rendering over the temporal noise of the detector, 95th percentile of the lit groups of rows")
        .as_card("QNOISE", "error over detector noise, 95 % of the groups")
        .as_member()
        .as_column(52, "noise_ratio_ppm", 1e6),
    field<&Q::unknown_share>("unknown_share")
        .at(0x030)
        .as_card("QUNKN", "share of lit pixels without an estimate")
        .as_member()
        .as_column(53, "unknown_ppm", 1e6),
    field<&Q::samples_mean>("samples_mean")
        .at(0x038)
        .as_feature("ChunkQualitySamplesMean", "Rays per lit pixel")
        .as_card("QSPPMEA", "mean of rays per lit pixel")
        .as_member(),
    field<&Q::samples_median>("samples_median")
        .at(0x040)
        .as_card("QSPPMED", "median of rays per lit pixel")
        .as_member(),
    field<&Q::samples_min>("samples_min")
        .at(0x048)
        .as_card("QSPPMIN", "least rays of a lit pixel")
        .as_member(),
    field<&Q::bounces>("bounces")
        .at(0x010)
        .as_card("QBOUNCE", "reflections after the first")
        .as_member()
        .as_column(55),
    field<&Q::bounces_asked>("bounces_asked").at(0x014).as_member().as_column(56),
    field<&Q::instants>("instants")
        .at(0x1c8)
        .as_feature("ChunkQualityInstants",
                    "Instants of the exposure at which the row with the fewest was sampled")
        .as_card("QINSTANT", "motion instants of the row with the fewest")
        .as_member()
        .as_column(54, "sampled_instants"),
    field<&Q::rows_reprojected>("rows_reprojected").at(0x1cc).as_member(),
    field<&Q::rows_repeated>("rows_repeated").at(0x1d0).as_member(),
    field<&Q::budget_us>("budget_us")
        .at(0x060)
        .as_feature("ChunkQualityBudget", "Time that rendering had")
        .in("us")
        .as_card("QBUDGET", "[us] that rendering had")
        .as_member()
        .as_column(47),
    field<&Q::spent_us>("spent_us")
        .at(0x068)
        .as_feature("ChunkQualitySpent", "Time that rendering took")
        .in("us")
        .as_card("QSPENT", "[us] that rendering took")
        .as_member()
        .as_column(48),
    field<&Q::margin_us>("margin_us")
        .at(0x070)
        .as_feature("ChunkQualityMargin", "Least time from the end of a group of rows to its deadline")
        .in("us")
        .as_card("QMARGIN", "[us] least time left at a deadline")
        .as_member()
        .as_column(49),
    field<&Q::level_share>("level_share").at(0x078),
    field<&Q::lod_deficit_share>("lod_deficit_share")
        .at(0x050)
        .as_feature("ChunkQualityLodDeficit",
                    "Share of hits on terrains that were on cells wider than asked for")
        .as_card("LODSHARE", "share of terrain on cells wider than asked for")
        .as_member("lod_deficit")
        .as_column(59, "lod_deficit_ppm", 1e6),
    field<&Q::lod_deficit_worst>("lod_deficit_worst")
        .at(0x058)
        .as_card("LODWORST", "factor by which they are wider, at least")
        .as_member()
        .as_column(60),
    field<&Q::tiles_missing>("tiles_missing")
        .at(0x01c)
        .as_feature("ChunkQualityTilesMissing", "Look-ups of tiles of terrains that were not there")
        .as_card("LODTILES", "look-ups of tiles that were not there")
        .as_member()
        .as_column(61),
    field<&Q::rays_doubtful>("rays_doubtful")
        .at(0x1d4)
        .as_feature(
            "ChunkQualityRaysDoubtful",
            "Rays to shapes in SuMoL of which it is not sure what they hit: the bound on the slope did not "
            "hold, or the steps ran out")
        .as_card("RAYSDOUB", "rays to shapes in SuMoL that are not sure")
        .as_member()
        .as_column(62),
};
static_assert(is_disjoint<Q>(quality_fields));
/// The fields from this one on are of terrains and shapes of users.
constexpr std::size_t first_of_terrain = [] {
    std::size_t i = 0;
    while (quality_fields[i].name != "lod_deficit_share")
        ++i;
    return i;
}();

using R = FrameRecord;
constexpr std::array timing_fields{
    field<&R::frame_id>("frame_id").as_column(0).from_the_first(),
    field<&R::trigger_id>("trigger_id").as_column(1).from_the_first(),
    field<&R::edge>("edge").as_column(2, "edge_ns").as_instant().from_the_first(),
    field<&R::seen>("seen").as_column(3, "seen_ns").as_instant().from_the_first(),
    field<&R::pose>("pose").as_column(4, "pose_ns").as_instant().from_the_first(),
    field<&R::render_begin>("render_begin").as_column(5, "render_begin_ns").as_instant().from_the_first(),
    field<&R::render_end>("render_end").as_column(6, "render_end_ns").as_instant().from_the_first(),
    field<&R::detector_end>("detector_end").as_column(7, "detector_end_ns").as_instant().from_the_first(),
    field<&R::due>("due").as_column(8, "due_ns").as_instant().from_the_first(),
    field<&R::first>("first").as_column(9, "first_ns").as_instant().from_the_first(),
    field<&R::last_due>("last_due").as_column(10, "last_due_ns").as_instant().from_the_first(),
    field<&R::last>("last").as_column(11, "last_ns").as_instant().from_the_first(),
    field<&R::rows>("rows").as_column(12).from_the_first(),
    field<&R::late_rows>("late_rows").as_column(13).from_the_first(),
    field<&R::worst_row>("worst_row").as_column(14, "worst_row_ns").from_the_first(),
    field<&R::worst_row_number>("worst_row_number").as_column(15, "worst_row").from_the_first(),
    field<&R::flags>("flags").as_column(16).from_the_first(),
    field<&R::acquisition>("acquisition").as_column(17),
    field<&R::min_period>("min_period").as_column(18, "min_period_ns"),
    field<&R::width>("width").as_column(19),
    field<&R::height>("height").as_column(20),
    field<&R::render_threads>("render_threads").as_column(21),
    field<&R::render_cores>("render_cores").as_column(22),
    field<&R::samples_per_pixel>("samples_per_pixel").as_column(23),
    field<&R::target_error>("target_error").as_column(24, "target_error_ppm", 1e6),
    field<&R::max_instants>("max_instants").as_column(25),
    field<&R::rendered_rows>("rendered_rows").as_column(26),
    field<&R::setup>("setup").as_column(27, "setup_ns"),
    field<&R::sampling>("sampling").as_column(28, "sampling_ns"),
    field<&R::grid>("grid").as_column(29, "grid_ns"),
    field<&R::wings>("wings").as_column(30, "wings_ns"),
    field<&R::points>("points").as_column(31, "points_ns"),
    field<&R::rest>("rest").as_column(32, "rest_ns"),
    field<&R::measured>("measured").as_column(33, "measured_ns"),
    field<&R::measured_cpu>("measured_cpu").as_column(34, "measured_cpu_ns"),
    field<&R::preemptions>("preemptions").as_column(35),
    field<&R::row_instants>("row_instants").as_column(36),
    field<&R::samples>("samples").as_column(37),
    field<&R::rays>("rays").as_column(38),
    field<&R::detector_wait>("detector_wait").as_column(39, "detector_wait_ns"),
    field<&R::detector>("detector").as_column(40, "detector_ns"),
    field<&R::ahead>("ahead").as_column(41, "ahead_ns"),
    field<&R::ahead_error_px>("ahead_error_px").as_column(42, "ahead_error_upx", 1e6),
    field<&R::page_faults>("page_faults").as_column(57),
    field<&R::stalled_rows>("stalled_rows").as_column(58),
};

template<typename Owner>
std::int64_t column_value(const RecordField<Owner>& field, const Owner& owner) {
    const FieldValue value = field.get(owner, field.first);
    if (const double* real = std::get_if<double>(&value))
        return field.column_scale > 0 ? std::llround(field.column_scale * *real)
                                      : static_cast<std::int64_t>(*real);
    if (const std::uint64_t* whole = std::get_if<std::uint64_t>(&value))
        return static_cast<std::int64_t>(*whole);
    return std::get<std::int64_t>(value);
}

template<typename Owner>
void set_column(const RecordField<Owner>& field, Owner& owner, std::int64_t value) {
    const auto set = [&](FieldValue v) { field.set(owner, field.first, v); };
    if (field.form == FieldForm::f64)
        set(static_cast<double>(value) / (field.column_scale > 0 ? field.column_scale : 1));
    else if (field.form == FieldForm::i32 || field.form == FieldForm::i64)
        set(value);
    else
        set(static_cast<std::uint64_t>(value));
}

} // namespace

template<>
std::span<const RecordField<FrameHead>> record_fields() noexcept {
    return head_fields;
}
template<>
std::span<const RecordField<FrameWindow>> record_fields() noexcept {
    return window_fields;
}
template<>
std::span<const RecordField<RowTime>> record_fields() noexcept {
    return row_fields;
}
template<>
std::span<const RecordField<FrameQuality>> record_fields() noexcept {
    return quality_fields;
}
template<>
std::span<const RecordField<FrameRecord>> record_fields() noexcept {
    return timing_fields;
}

std::span<const RecordField<FrameQuality>> level_fields() noexcept {
    return std::span(quality_fields).first(first_of_terrain);
}

std::span<const RecordField<FrameQuality>> terrain_fields() noexcept {
    return std::span(quality_fields).subspan(first_of_terrain);
}

Chunk chunk_of(const RecordField<FrameHead>& field) noexcept {
    return head_chunks[static_cast<std::size_t>(&field - head_fields.data())];
}

const RecordField<FrameHead>* head_field(Chunk chunk) noexcept {
    const auto found = std::find(head_chunks.begin(), head_chunks.end(), chunk);
    return found == head_chunks.end() ? nullptr
                                      : &head_fields[static_cast<std::size_t>(found - head_chunks.begin())];
}

std::int64_t TimingColumn::value(const FrameRecord& frame) const {
    return field != nullptr ? column_value(*field, frame) : column_value(*quality, frame.quality);
}

void TimingColumn::set(FrameRecord& frame, std::int64_t value) const {
    if (field != nullptr)
        set_column(*field, frame, value);
    else
        set_column(*quality, frame.quality, value);
}

std::span<const TimingColumn> timing_columns() {
    constexpr auto of = [](const auto& field) { return field.column_place >= 0; };
    constexpr std::size_t count =
        static_cast<std::size_t>(std::count_if(timing_fields.begin(), timing_fields.end(), of) +
                                 std::count_if(quality_fields.begin(), quality_fields.end(), of));
    static constexpr auto columns = [] {
        std::array<TimingColumn, count> all{};
        for (const RecordField<FrameRecord>& f : timing_fields)
            all.at(static_cast<std::size_t>(f.column_place)) = {f.column, f.is_instant, f.in_first_files, &f,
                                                                nullptr};
        for (const RecordField<FrameQuality>& f : quality_fields)
            if (f.column_place >= 0)
                all.at(static_cast<std::size_t>(f.column_place)) = {f.column, false, false, nullptr, &f};
        return all;
    }();
    static_assert(std::none_of(columns.begin(), columns.end(),
                               [](const TimingColumn& column) { return column.name.empty(); }),
                  "each place has one column");
    return columns;
}

std::int64_t in_millionths(double value) noexcept {
    return std::llround(1e6 * value);
}

} // namespace obscura
