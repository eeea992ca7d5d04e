// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/frame_chunks.hpp"

#include "core/camera/frame_flags.hpp"
#include "core/camera/frame_record.hpp"
#include "core/error.hpp"
#include "host/frame_members.hpp"
#include "images/writers/truth_table.hpp"
#include "tools/scene/vector_json.hpp"
#include "transports/gige/wire/chunk.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

namespace obscura::tools {
namespace {

/// Data of one chunk; checks every length.
class ChunkReader {
public:
    ChunkReader(std::span<const std::uint8_t> bytes, Chunk chunk) : bytes_(bytes), chunk_(chunk) {}
    /// The record that begins at byte `begin`.
    template<typename Owner>
    [[nodiscard]] Owner record(std::size_t begin = 0) const {
        check(begin + record_bytes<Owner>());
        return transports::gige::load_record<Owner>(bytes_.data() + begin);
    }
    template<typename Owner>
    void field(const RecordField<Owner>& field, Owner& owner) const {
        check(bytes_of(field.form));
        transports::gige::load_field(bytes_.data(), field, owner);
    }
    /// Items of a list, at most `max_count` of them.
    template<typename Owner>
    [[nodiscard]] std::vector<Owner> list(std::size_t max_count) const {
        std::vector<Owner> items(count(max_count));
        for (std::size_t i = 0; i < items.size(); ++i)
            items[i] = record<Owner>(list_head_bytes + i * record_bytes<Owner>());
        return items;
    }
    [[nodiscard]] std::uint32_t count(std::size_t max_count) const { return checked(word(0), max_count); }
    [[nodiscard]] std::uint32_t checked(std::uint32_t count, std::size_t max_count) const {
        if (count > max_count) fail();
        return count;
    }
    [[nodiscard]] std::uint32_t word(std::size_t index) const {
        check(4 * (index + 1));
        return transports::gige::load_be32(bytes_.data() + 4 * index);
    }

private:
    void check(std::size_t bytes) const {
        if (bytes_.size() < bytes) fail();
    }
    [[noreturn]] void fail() const {
        throw InputError(
            fmt::format("chunk {}: missing in a frame, or shorter than its contents", name_of(chunk_)));
    }
    std::span<const std::uint8_t> bytes_;
    Chunk chunk_;
};

FrameQuality read_quality(const ChunkReader& reader) {
    auto quality = reader.record<FrameQuality>();
    (void)reader.checked(quality.groups, max_quality_groups);
    return quality;
}

GroundTruth read_truth(const ChunkReader& reader) {
    auto truth = reader.record<GroundTruth>();
    (void)reader.checked(truth.body_count, max_truth_bodies);
    for (std::size_t b = 0; b < max_truth_bodies; ++b) {
        truth.bodies[b] = reader.record<BodyTruth>(truth_bodies_offset + b * record_bytes<BodyTruth>());
        truth.bodies[b].pose_age_s =
            reader.record<BodyAge>(truth_ages_offset + b * record_bytes<BodyAge>()).pose_age_s;
    }
    return truth;
}

/// Frames of cameras without the chunk have no entries.
SceneTruth read_truth_table(std::span<const std::uint8_t> bytes, std::uint64_t frame_id) {
    SceneTruth out;
    out.frame_id = frame_id;
    if (bytes.empty()) return out;
    const ChunkReader reader(bytes, Chunk::truth_table);
    out.entries = reader.list<TruthEntry>(bytes.size() / record_bytes<TruthEntry>());
    out.entries_left_out = reader.word(1);
    return out;
}

std::vector<std::uint32_t> read_region_ids(const ChunkReader& reader, std::size_t windows) {
    std::vector<std::uint32_t> regions(reader.count(max_windows));
    for (std::size_t i = 0; i < regions.size(); ++i)
        regions[i] = reader.word(1 + i);
    regions.resize(windows);
    return regions;
}

std::string name_of(const BodyTruth& body) {
    return {body.name.data(), static_cast<std::size_t>(std::find(body.name.begin(), body.name.end(), '\0') -
                                                       body.name.begin())};
}

using Json = nlohmann::ordered_json;

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
    return Json{{"position_m", vector_json(pose.position_m)},
                {"attitude", quaternion_json(pose.orientation)},
                {"pose_age_s", age_s}};
}

} // namespace

FrameChunks parse_chunks(const std::function<std::span<const std::uint8_t>(std::uint32_t id)>& chunk) {
    const auto reader = [&](Chunk c) { return ChunkReader(chunk(transports::gige::chunk_id(c)), c); };
    FrameChunks out;
    FrameHead& head = out;
    for (const RecordField<FrameHead>& field : record_fields<FrameHead>())
        reader(chunk_of(field)).field(field, head);
    out.windows = reader(Chunk::regions).list<FrameWindow>(max_windows);
    out.regions = read_region_ids(reader(Chunk::region_id), out.windows.size());
    constexpr std::size_t max_rows = 65536;
    out.rows = reader(Chunk::row_times).list<RowTime>(max_rows);
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
             {"failed", (c.flags & frame_failed) != 0},
             {"pose_held", (c.flags & frame_pose_held) != 0},
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
        Json window{{"region", c.regions[i]}};
        host::add_members(window, c.windows[i]);
        out["windows"].push_back(std::move(window));
    }
    out["rows"] = Json::array();
    for (const RowTime& row : c.rows)
        out["rows"].push_back(Json::array({row.reset.ns, row.read.ns}));
    out["truth_table"] = Json::array();
    for (const TruthEntry& entry : c.truth_table.entries)
        out["truth_table"].push_back(entry_json(c.truth_table, entry));
    host::add_members(out["quality"], c.quality);
    out["truth_entries_left_out"] = c.truth_table.entries_left_out;
    return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace obscura::tools
