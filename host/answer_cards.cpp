// SPDX-License-Identifier: Apache-2.0
#include "host/answer_cards.hpp"

#include "core/camera/frame.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace obscura::host {
namespace {

using Json = nlohmann::ordered_json;

std::optional<std::int64_t> whole(const Json& head, const char* name) {
    const auto found = head.find(name);
    if (found == head.end() || !found->is_number_integer()) return std::nullopt;
    return found->get<std::int64_t>();
}

std::string text_of(const Json& head, const char* name) {
    const auto found = head.find(name);
    return found == head.end() || !found->is_string() ? std::string() : found->get<std::string>();
}

std::optional<double> number(const Json& value) {
    return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

/// Cards of the numbers of an array, for the keys in turn.
template<std::size_t Count>
void add_number_cards(images::Cards& cards, const Json& head, const char* name,
                      const std::array<const char*, Count>& keys, const char* comment) {
    const auto found = head.find(name);
    if (found == head.end() || !found->is_array() || found->size() != Count) return;
    for (std::size_t i = 0; i < Count; ++i)
        if (const auto value = number((*found)[i])) cards.push_back({keys[i], *value, comment});
}

} // namespace

images::Cards cards_of_answer(const nlohmann::ordered_json& head) {
    images::Cards cards;
    const auto add_whole = [&](const char* key, const char* name, const char* comment) {
        if (const auto value = whole(head, name)) cards.push_back({key, *value, comment});
    };
    add_whole("FRAMEID", "frame", "counts from 1 at acquisition start");
    add_whole("TRIGID", "trigger", "trigger that asked for the frame");
    add_whole("BITS", "bits", "depth of the converter");
    if (const auto us = number(head.value("exposure_us", Json())))
        cards.push_back({"EXPOSURE", *us / 1e6, "[s] requested exposure time"});
    if (const auto gain = number(head.value("gain_db", Json()))) cards.push_back({"GAIN", *gain, "[dB]"});
    add_whole("T_EDGE", "edge_tai_ns", "[ns] trigger edge, TAI");
    add_whole("T_MID", "mid_exposure_tai_ns", "[ns] mid-exposure, TAI");
    cards.push_back({"TAIOFF", std::int64_t{0}, "[ns] TAI minus the clock of these times"});
    add_whole("ROWS", "rows", "rows that are there, the others are 0");
    if (const auto flags = whole(head, "flags")) {
        const auto add_flag = [&](const char* key, FrameFlag flag, const char* comment) {
            cards.push_back({key, (*flags & flag) != 0, comment});
        };
        add_flag("PARTIAL", frame_partial, "rows at the bottom are missing");
        add_flag("LATE", frame_late, "a row was late");
        add_flag("STALLED", frame_stalled, "a row was ready in time and left late");
        add_flag("DEGRADED", frame_degraded, "a row is not of full quality");
        add_flag("NOLAG", frame_lag_unknown, "image lag of the frame before is missing");
    }
    cards.push_back({"CAMAXES", std::string("x right, y down, z boresight"), "axes of the camera"});
    cards.push_back({"QUATCONV", std::string("scalar first, own axes to inertial"), "meaning of CAM_Q"});
    add_number_cards(cards, head, "camera_position_m", std::array{"CAM_X", "CAM_Y", "CAM_Z"},
                     "[m] position of the camera");
    add_number_cards(cards, head, "camera_orientation", std::array{"CAM_QW", "CAM_QX", "CAM_QY", "CAM_QZ"},
                     "own axes to inertial, the camera");
    if (const std::string hash = text_of(head, "config_sha256");
        hash.size() == 64 && hash.find_first_not_of("0123456789abcdef") == std::string::npos)
        cards.push_back({"CFGSHA", hash, "configuration"});
    return cards;
}

} // namespace obscura::host
