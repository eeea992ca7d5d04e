// SPDX-License-Identifier: Apache-2.0
#include "images/writers/card.hpp"

#include "core/camera/frame_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace obscura::images {
namespace {

/// The fields of a record that have cards, with `prefix` before their keys.
template<typename Fields, typename Owner>
void add_cards(Cards& cards, const Fields& fields, const Owner& owner, std::string_view prefix = {}) {
    for (const RecordField<Owner>& field : fields) {
        if (field.card.empty()) continue;
        Card& card = cards.emplace_back();
        card.key = fmt::format("{}{}", prefix, field.card);
        card.comment = field.card_help;
        const FieldValue value = field.get(owner, field.first);
        if (field.text != nullptr)
            card.value = std::string(field.text(owner, field.first));
        else if (const auto* real = std::get_if<double>(&value))
            card.value = *real;
        else if (const auto* whole = std::get_if<std::uint64_t>(&value))
            card.value = static_cast<std::int64_t>(*whole);
        else
            card.value = std::get<std::int64_t>(value);
    }
}

void add_pose(Cards& cards, std::string_view prefix, const Pose& pose, double age_s, std::string_view whose) {
    const auto add = [&](std::string_view suffix, double value, std::string_view text) {
        cards.push_back({fmt::format("{}{}", prefix, suffix), value, fmt::format("{} {}", text, whose)});
    };
    add("_X", pose.position_m.x, "[m] position of");
    add("_Y", pose.position_m.y, "[m] position of");
    add("_Z", pose.position_m.z, "[m] position of");
    add("_QW", pose.orientation.w, "own axes to inertial,");
    add("_QX", pose.orientation.x, "own axes to inertial,");
    add("_QY", pose.orientation.y, "own axes to inertial,");
    add("_QZ", pose.orientation.z, "own axes to inertial,");
    add("_AGE", age_s, "[s] since the newest pose of");
}

} // namespace

Cards intrinsics_cards(const Intrinsics& i) {
    if (!(i.pixel_pitch_m[0] > 0)) return {};
    return {
        {"XPIXSZ", 1e6 * i.pixel_pitch_m[0], "[um] pitch of the columns"},
        {"YPIXSZ", 1e6 * i.pixel_pitch_m[1], "[um] pitch of the rows"},
        {"FOCALLEN", 1e3 * (i.focal_length_px[0] * i.pixel_pitch_m[0]), "[mm] focal length"},
        {"FX", i.focal_length_px[0], "[px] focal length over XPIXSZ"},
        {"FY", i.focal_length_px[1], "[px] focal length over YPIXSZ"},
        {"CX", i.principal_point_px[0], "[px] principal point, column from 0"},
        {"CY", i.principal_point_px[1], "[px] principal point, row from 0"},
        {"PIXCENTR", 0.0, "[px] centre of the first pixel, both axes"},
    };
}

Cards window_cards(std::span<const FrameWindow> windows, std::span<const std::uint32_t> flags) {
    Cards cards{{"WINDOWS", static_cast<std::int64_t>(windows.size()), "in the image, one below the other"}};
    for (std::size_t i = 0; i < windows.size(); ++i) {
        const FrameWindow& w = windows[i];
        const auto add = [&](std::string_view suffix, std::int64_t value, std::string_view text) {
            cards.push_back({fmt::format("W{:02}_{}", i, suffix), value, std::string(text)});
        };
        add_cards(cards, record_fields<FrameWindow>(), w, fmt::format("W{:02}_", i));
        add("FLAG", flags[i], "readout flags, see obscura sensor flags");
        if (w.sampling != Sampling::destructive) {
            add("NRD", w.reads, "non-destructive reads");
            add("RD", w.read_index, "this is read number");
        }
    }
    return cards;
}

Cards scene_cards(const GroundTruth& truth) {
    Cards cards{
        {"CAMAXES", std::string("x right, y down, z boresight"), "axes of the camera"},
        {"QUATCONV", std::string("scalar first, own axes to inertial"), "meaning of _QW, _QX, _QY, _QZ"},
        {"SUN_X", truth.sun_position_m.x, "[m] position of the Sun"},
        {"SUN_Y", truth.sun_position_m.y, "[m] position of the Sun"},
        {"SUN_Z", truth.sun_position_m.z, "[m] position of the Sun"}};
    add_pose(cards, "CAM", truth.camera, truth.camera_pose_age_s, "the camera");
    for (std::uint32_t i = 0; i < std::min<std::uint32_t>(truth.body_count, max_truth_bodies); ++i) {
        const BodyTruth& body = truth.bodies[i];
        const std::string name(body.name.data(),
                               std::find(body.name.begin(), body.name.end(), '\0') - body.name.begin());
        cards.push_back({fmt::format("BODY{}", i), name, "name of a body"});
        add_pose(cards, fmt::format("B{}", i), body.pose, body.pose_age_s, name);
    }
    return cards;
}

Cards quality_cards(const FrameQuality& quality) {
    if (quality.groups == 0) return {};
    Cards cards;
    add_cards(cards, level_fields(), quality);
    return cards;
}

Cards frame_cards(const Frame& frame) {
    const FrameInfo& info = frame.info;
    const auto whole = [](auto value) { return static_cast<std::int64_t>(value); };
    Cards cards{
        {"FRAMEID", whole(info.frame_id), "counts from 1 at acquisition start"},
        {"TRIGID", whole(info.trigger_id), "trigger that asked for the frame"},
        {"BITS", whole(info.bits_per_pixel), "depth of the converter"},
        {"EXPOSURE", to_seconds(info.exposure_ns), "[s] requested exposure time"},
        {"GAIN", info.gain_db, "[dB]"},
        {"SEED", whole(info.truth.seed), "of the random numbers"},
        {"RUN", whole(info.truth.run), "run word of the temporal noise"},
        {"T_EDGE", whole(info.trigger_edge.ns), "[ns] trigger edge, scheduling clock"},
        {"T_MID", whole(info.truth.mid_exposure.ns), "[ns] mid-exposure, scheduling clock"},
        {"TAIOFF", info.tai_offset_ns, "[ns] TAI minus scheduling clock"},
        {"PARTIAL", !frame.complete(), "rows at the bottom are missing"},
        {"CLKSTATE", std::string(name_of(frame.info.clock_state)),
         "of what triggered: free, locked, holdover"},
    };
    const std::uint32_t flags = frame.flags.load(std::memory_order_relaxed);
    for (const FlagCard& card : flag_cards)
        if (card.flag != frame_partial)
            cards.push_back({std::string(card.key), (flags & card.flag) != 0, std::string(card.comment)});
    const Cards camera = intrinsics_cards(info.truth.intrinsics);
    cards.insert(cards.end(), camera.begin(), camera.end());
    if (info.window_count > 0) {
        cards.push_back({"OFFSETX", whole(info.windows[0].sensor.x), "[px] first sensor column"});
        cards.push_back({"OFFSETY", whole(info.windows[0].sensor.y), "[px] first sensor row"});
        const auto count = std::min<std::size_t>(info.window_count, max_windows);
        std::array<std::uint32_t, max_windows> window_flags{};
        for (std::size_t i = 0; i < count; ++i)
            window_flags[i] = frame.window_flags(i);
        const Cards windows = window_cards(std::span(info.windows).first(count), window_flags);
        cards.insert(cards.end(), windows.begin(), windows.end());
    }
    const FrameQuality& quality = info.quality;
    const Cards made = quality_cards(quality);
    cards.insert(cards.end(), made.begin(), made.end());
    if (quality.lod_deficit_share > 0 || quality.tiles_missing > 0 || quality.rays_doubtful > 0)
        add_cards(cards, terrain_fields(), quality);
    const Cards scene = scene_cards(info.truth);
    cards.insert(cards.end(), scene.begin(), scene.end());
    return cards;
}

std::string card_text(const Card& card) {
    if (const auto* text = std::get_if<std::string>(&card.value)) return *text;
    if (const auto* flag = std::get_if<bool>(&card.value)) return *flag ? "true" : "false";
    if (const auto* whole = std::get_if<std::int64_t>(&card.value)) return fmt::format("{}", *whole);
    return fmt::format("{}", std::get<double>(card.value));
}

} // namespace obscura::images
