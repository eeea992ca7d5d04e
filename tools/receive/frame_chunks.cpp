// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/frame_chunks.hpp"

#include "core/camera/frame_flags.hpp"
#include "core/error.hpp"
#include "images/writers/truth_table.hpp"
#include "transports/gige/wire/bytes.hpp"
#include "transports/gige/wire/chunk.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

namespace obscura::tools {
namespace {

using transports::gige::Chunk;

/// In the order of Chunk.
constexpr std::array<const char*, transports::gige::chunk_count> names{
    "Timestamp",   "ExposureTime", "Gain",          "FrameID",
    "Width",       "Height",       "OffsetX",       "OffsetY",
    "PixelFormat", "TriggerID",    "FrameFlags",    "Regions",
    "RowTimes",    "GroundTruth",  "LineStatusAll", "SequencerSetActive",
    "RegionID",    "TruthTable",   "FrameQuality"};

/// Decoder of consecutive big-endian numbers; checks every length.
class Reader {
public:
    Reader(std::span<const std::uint8_t> bytes, const char* name) : bytes_(bytes), name_(name) {}
    std::uint32_t u32() { return transports::gige::load_be32(take(4)); }
    std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
    std::uint64_t u64() { return transports::gige::load_be64(take(8)); }
    std::int64_t i64() { return static_cast<std::int64_t>(u64()); }
    double f64() { return std::bit_cast<double>(u64()); }
    Vec3 vector() {
        const double x = f64(), y = f64(), z = f64();
        return {x, y, z};
    }
    Pose pose() {
        Pose out;
        out.position_m = vector();
        out.orientation.w = f64(), out.orientation.x = f64(), out.orientation.y = f64(),
        out.orientation.z = f64();
        return out;
    }
    void text(std::span<char> out) { std::memcpy(out.data(), take(out.size()), out.size()); }
    /// The last one for numbers that are none.
    template<typename Enum>
    Enum choice() {
        return static_cast<Enum>(std::min<std::size_t>(u32(), enum_names(Enum{}).size() - 1));
    }
    template<typename Enum>
    Enum choice_byte() {
        return static_cast<Enum>(std::min<std::size_t>(*take(1), enum_names(Enum{}).size() - 1));
    }
    /// Number of entries of a list, not above `most`.
    std::uint32_t count(std::size_t most) {
        const std::uint32_t n = u32();
        if (n > most) fail();
        return n;
    }

private:
    const std::uint8_t* take(std::size_t n) {
        if (bytes_.size() < n) fail();
        const std::uint8_t* const at = bytes_.data();
        bytes_ = bytes_.subspan(n);
        return at;
    }
    [[noreturn]] void fail() const {
        throw InputError(fmt::format("chunk {}: missing in a frame, or shorter than its contents", name_));
    }
    std::span<const std::uint8_t> bytes_;
    const char* name_;
};

FrameQuality read_quality(Reader reader) {
    FrameQuality out;
    out.level_max = reader.choice<QualityLevel>();
    out.reasons = reader.u32();
    out.groups = reader.count(max_quality_groups);
    out.group_rows = reader.i32();
    out.bounces = reader.u32(), out.bounces_asked = reader.u32();
    out.rows_degraded = reader.i32();
    out.tiles_missing = reader.u32();
    for (float* const value :
         {&out.error_rms, &out.error_worst_group, &out.unknown_share, &out.samples_mean, &out.samples_median,
          &out.samples_min, &out.lod_deficit_share, &out.lod_deficit_worst})
        *value = static_cast<float>(reader.f64());
    out.budget_us = reader.i64(), out.spent_us = reader.i64(), out.margin_us = reader.i64();
    for (float& share : out.level_share)
        share = static_cast<float>(reader.f64());
    for (QualityLevel& level : out.group_level)
        level = reader.choice_byte<QualityLevel>();
    out.instants = reader.u32();
    out.rows_reprojected = reader.i32(), out.rows_repeated = reader.i32();
    reader.u32();
    for (float* const value : {&out.error_goal, &out.noise_ratio_p95})
        *value = static_cast<float>(reader.f64());
    return out;
}

std::vector<FrameWindow> read_windows(Reader reader) {
    std::vector<FrameWindow> out(reader.count(max_windows));
    reader.u32();
    for (FrameWindow& w : out) {
        w.sensor.x = reader.i32(), w.sensor.y = reader.i32();
        w.sensor.width = reader.i32(), w.sensor.height = reader.i32();
        w.image_y = reader.i32(), w.flags = reader.u32();
        w.exposure_requested_ns = reader.i64();
        w.exposure_min_ns = reader.i64(), w.exposure_max_ns = reader.i64();
    }
    return out;
}

GroundTruth read_truth(Reader reader) {
    GroundTruth out;
    out.mid_exposure = Time{reader.i64()};
    out.camera = reader.pose();
    out.sun_position_m = reader.vector();
    out.seed = reader.u64();
    out.body_count = reader.count(max_truth_bodies);
    out.run = reader.u32();
    for (BodyTruth& body : out.bodies) {
        reader.text(body.name);
        body.pose = reader.pose();
    }
    for (double& px : out.intrinsics.focal_length_px)
        px = reader.f64();
    for (double& px : out.intrinsics.principal_point_px)
        px = reader.f64();
    for (double& pitch_m : out.intrinsics.pixel_pitch_m)
        pitch_m = reader.f64() * 1e-6;
    out.camera_pose_age_s = reader.f64();
    for (BodyTruth& body : out.bodies)
        body.pose_age_s = reader.f64();
    return out;
}

/// Frames of cameras without the chunk have no entries.
SceneTruth read_truth_table(std::span<const std::uint8_t> bytes, std::uint64_t frame_id) {
    SceneTruth out;
    out.frame_id = frame_id;
    if (bytes.empty()) return out;
    Reader reader(bytes, "TruthTable");
    out.entries.resize(reader.count(bytes.size() / transports::gige::truth_entry_bytes));
    out.entries_left_out = reader.u32();
    for (TruthEntry& e : out.entries) {
        e.kind = reader.choice<TruthKind>();
        e.visibility = reader.choice<TruthVisibility>();
        const std::uint32_t flags = reader.u32();
        e.lit = (flags & 1) != 0, e.saturated = (flags & 2) != 0;
        e.window = static_cast<std::uint16_t>(reader.u32());
        e.object = reader.i32(), e.item = reader.i32();
        std::array<char, TruthName::size> name{};
        reader.text(name);
        e.name.set({name.data(),
                    static_cast<std::size_t>(std::find(name.begin(), name.end(), '\0') - name.begin())});
        e.x_px = reader.f64(), e.y_px = reader.f64();
        e.time = Time{reader.i64()};
        e.exposure_ns = reader.i64();
        for (double* value : {&e.range_m, &e.visible_share, &e.magnitude_v, &e.irradiance_w_m2, &e.signal_e,
                              &e.peak_e, &e.snr, &e.psf_x_px, &e.psf_y_px})
            *value = reader.f64();
    }
    return out;
}

std::string name_of(const BodyTruth& body) {
    return {body.name.data(), static_cast<std::size_t>(std::find(body.name.begin(), body.name.end(), '\0') -
                                                       body.name.begin())};
}

using Json = nlohmann::ordered_json;

Json vector_json(Vec3 v) {
    return Json::array({v.x, v.y, v.z});
}

/// An entry by the names of columns, see docs/truth.md; what is not known is null.
Json entry_json(const SceneTruth& truth, const TruthEntry& entry) {
    Json out = Json::object();
    for (const images::TruthColumn& column : images::truth_columns()) {
        const images::TruthCell cell = column.cell(truth, entry);
        Json& value = out[std::string(column.name)];
        std::visit([&](const auto& v) { value = v; }, cell);
    }
    return out;
}

Json pose_json(const Pose& pose, double age_s) {
    const Quat& q = pose.orientation;
    return Json{{"position_m", vector_json(pose.position_m)},
                {"attitude", Json::array({q.w, q.x, q.y, q.z})},
                {"pose_age_s", age_s}};
}

} // namespace

std::span<const char* const> chunk_names() {
    return names;
}

FrameChunks parse_chunks(const std::function<std::span<const std::uint8_t>(std::uint32_t id)>& chunk) {
    const auto reader = [&](Chunk c) {
        return Reader(chunk(transports::gige::chunk_id(c)), names[static_cast<std::size_t>(c)]);
    };
    FrameChunks out;
    out.timestamp_ns = reader(Chunk::timestamp).u64();
    out.exposure_us = reader(Chunk::exposure_time).f64();
    out.gain_db = reader(Chunk::gain).f64();
    out.frame_id = reader(Chunk::frame_id).u64();
    out.trigger_id = reader(Chunk::trigger_id).u64();
    out.image = {reader(Chunk::offset_x).i32(), reader(Chunk::offset_y).i32(), reader(Chunk::width).i32(),
                 reader(Chunk::height).i32()};
    out.pixel_format = reader(Chunk::pixel_format).u32();
    out.flags = reader(Chunk::frame_flags).u32();
    out.line_status = reader(Chunk::line_status_all).u32();
    out.sequencer_set = reader(Chunk::sequencer_set_active).u32();
    out.windows = read_windows(reader(Chunk::regions));
    Reader regions = reader(Chunk::region_id);
    out.regions.resize(regions.count(max_windows));
    for (std::uint32_t& region : out.regions)
        region = regions.u32();
    out.regions.resize(out.windows.size());
    Reader rows = reader(Chunk::row_times);
    constexpr std::size_t most_rows = 65536;
    out.rows.resize(rows.count(most_rows));
    rows.u32();
    for (RowTime& row : out.rows)
        row.reset = Time{rows.i64()}, row.read = Time{rows.i64()};
    out.truth = read_truth(reader(Chunk::ground_truth));
    out.truth_table = read_truth_table(chunk(transports::gige::chunk_id(Chunk::truth_table)), out.frame_id);
    out.quality = read_quality(reader(Chunk::frame_quality));
    return out;
}

images::Cards chunk_cards(const FrameChunks& c) {
    const auto whole = [](auto value) { return static_cast<std::int64_t>(value); };
    images::Cards cards{
        {"TRIGID", whole(c.trigger_id), "trigger that asked for the frame"},
        {"EXPOSURE", c.exposure_us * 1e-6, "[s] requested exposure time"},
        {"GAIN", c.gain_db, "[dB]"},
        {"SEED", whole(c.truth.seed), "of the random numbers"},
        {"RUN", whole(c.truth.run), "run word of the temporal noise"},
        {"T_EDGE", whole(c.timestamp_ns), "[ns] trigger edge, camera's clock"},
        {"T_MID", whole(c.truth.mid_exposure.ns), "[ns] mid-exposure, camera's clock"},
        {"FLAGS", whole(c.flags), "frame flags, bits"},
    };
    const auto append = [&](const images::Cards& more) {
        cards.insert(cards.end(), more.begin(), more.end());
    };
    append(images::intrinsics_cards(c.truth.intrinsics));
    append(images::quality_cards(c.quality));
    cards.push_back({"OFFSETX", whole(c.image.x), "[px] first sensor column"});
    cards.push_back({"OFFSETY", whole(c.image.y), "[px] first sensor row"});
    std::vector<std::uint32_t> flags;
    flags.reserve(c.windows.size());
    for (const FrameWindow& w : c.windows)
        flags.push_back(w.flags);
    append(images::window_cards(c.windows, flags));
    append(images::scene_cards(c.truth));
    return cards;
}

std::string chunk_json(const FrameChunks& c, const std::string& file) {
    Json out{{"file", file},
             {"frame_id", c.frame_id},
             {"trigger_id", c.trigger_id},
             {"timestamp_ns", c.timestamp_ns},
             {"mid_exposure_ns", c.truth.mid_exposure.ns},
             {"exposure_us", c.exposure_us},
             {"gain_db", c.gain_db},
             {"offset", Json::array({c.image.x, c.image.y})},
             {"size", Json::array({c.image.width, c.image.height})},
             {"pixel_format", fmt::format("{:#010x}", c.pixel_format)},
             {"late", (c.flags & frame_late) != 0},
             {"stalled", (c.flags & frame_stalled) != 0},
             {"repeated", (c.flags & frame_repeated) != 0},
             {"partial", (c.flags & frame_partial) != 0},
             {"flags", c.flags},
             {"line_status", c.line_status},
             {"sequencer_set", c.sequencer_set},
             {"seed", c.truth.seed},
             {"run", c.truth.run},
             {"camera", pose_json(c.truth.camera, c.truth.camera_pose_age_s)},
             {"sun_position_m", vector_json(c.truth.sun_position_m)}};
    out["bodies"] = Json::array();
    for (std::uint32_t i = 0; i < c.truth.body_count; ++i) {
        Json body{{"name", name_of(c.truth.bodies[i])}};
        body.update(pose_json(c.truth.bodies[i].pose, c.truth.bodies[i].pose_age_s));
        out["bodies"].push_back(std::move(body));
    }
    const Intrinsics& lens = c.truth.intrinsics;
    out["focal_length_px"] = lens.focal_length_px;
    out["principal_point_px"] = lens.principal_point_px;
    out["pixel_pitch_um"] = Json::array({1e6 * lens.pixel_pitch_m[0], 1e6 * lens.pixel_pitch_m[1]});
    out["windows"] = Json::array();
    for (std::size_t i = 0; i < c.windows.size(); ++i) {
        const FrameWindow& w = c.windows[i];
        out["windows"].push_back({{"region", c.regions[i]},
                                  {"x", w.sensor.x},
                                  {"y", w.sensor.y},
                                  {"width", w.sensor.width},
                                  {"height", w.sensor.height},
                                  {"image_y", w.image_y},
                                  {"flags", w.flags},
                                  {"exposure_requested_ns", w.exposure_requested_ns},
                                  {"exposure_min_ns", w.exposure_min_ns},
                                  {"exposure_max_ns", w.exposure_max_ns}});
    }
    out["rows"] = Json::array();
    for (const RowTime& row : c.rows)
        out["rows"].push_back(Json::array({row.reset.ns, row.read.ns}));
    out["truth_table"] = Json::array();
    for (const TruthEntry& entry : c.truth_table.entries)
        out["truth_table"].push_back(entry_json(c.truth_table, entry));
    const FrameQuality& quality = c.quality;
    Json levels = Json::array();
    for (std::uint32_t g = 0; g < quality.groups; ++g)
        levels.push_back(name_of(quality.group_level[g]));
    out["quality"] = {{"level", name_of(quality.level_max)},
                      {"reasons", quality.reasons},
                      {"group_rows", quality.group_rows},
                      {"group_levels", std::move(levels)},
                      {"rows_degraded", quality.rows_degraded},
                      {"error", quality.error_rms},
                      {"error_worst_group", quality.error_worst_group},
                      {"error_goal", quality.error_goal},
                      {"noise_ratio_p95", quality.noise_ratio_p95},
                      {"unknown_share", quality.unknown_share},
                      {"samples_mean", quality.samples_mean},
                      {"samples_median", quality.samples_median},
                      {"samples_min", quality.samples_min},
                      {"bounces", quality.bounces},
                      {"bounces_asked", quality.bounces_asked},
                      {"instants", quality.instants},
                      {"rows_reprojected", quality.rows_reprojected},
                      {"rows_repeated", quality.rows_repeated},
                      {"budget_us", quality.budget_us},
                      {"spent_us", quality.spent_us},
                      {"margin_us", quality.margin_us},
                      {"lod_deficit", quality.lod_deficit_share},
                      {"lod_deficit_worst", quality.lod_deficit_worst},
                      {"tiles_missing", quality.tiles_missing}};
    out["truth_entries_left_out"] = c.truth_table.entries_left_out;
    return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace obscura::tools
