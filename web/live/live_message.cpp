// SPDX-License-Identifier: Apache-2.0
#include "web/live/live_message.hpp"

#include "core/error.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t max_token_bytes = 256;

[[noreturn]] void refuse_message(std::string_view why) {
    throw InputError(std::string(why));
}

std::uint32_t number_of(const Json& view, const char* name, std::uint32_t most, std::uint32_t by_default) {
    const auto found = view.find(name);
    if (found == view.end()) return by_default;
    if (!found->is_number_unsigned() || found->get<std::uint64_t>() > most)
        refuse_message(fmt::format("view: {}: a whole number from 0 to {}", name, most));
    return found->get<std::uint32_t>();
}

ViewRequest requested_view(const Json& json) {
    if (!json.is_object()) refuse_message("view: an object");
    constexpr std::array allowed{"camera", "x", "y", "w", "h", "bin", "reduce", "max_hz", "enc"};
    for (const auto& [key, value] : json.items())
        if (std::find(allowed.begin(), allowed.end(), key) == allowed.end())
            refuse_message(fmt::format("view: {}", allowed_words(key, {allowed.begin(), allowed.end()})));
    ViewRequest out;
    const auto text = [&json](const char* name) {
        const auto found = json.find(name);
        return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
    };
    const std::optional<CameraId> camera = camera_id_of(text("camera"));
    if (!camera) refuse_message("view: camera: the id of a camera, as \"4711-0\"");
    out.camera = *camera;
    View& view = out.view;
    view.x = number_of(json, "x", View::max_side, 0);
    view.y = number_of(json, "y", View::max_side, 0);
    view.width = number_of(json, "w", View::max_side, 0);
    view.height = number_of(json, "h", View::max_side, 0);
    view.bin = number_of(json, "bin", View::max_bin, 1);
    if (view.bin == 0 || (view.bin & (view.bin - 1)) != 0)
        refuse_message(fmt::format("view: bin: a power of two from 1 to {}", View::max_bin));
    if (json.contains("reduce")) {
        const std::optional<Reduce> reduce = enum_named<Reduce>(text("reduce"));
        if (!reduce) refuse_message("view: reduce: max or mean");
        view.reduce = *reduce;
    }
    if (json.contains("enc")) {
        const std::optional<PictureEncoding> encoding = enum_named<PictureEncoding>(text("enc"));
        if (!encoding) refuse_message("view: enc: u16, jpeg or auto");
        out.encoding = *encoding;
    }
    if (const auto hz = json.find("max_hz"); hz != json.end()) {
        // Not a number fails, too.
        if (!hz->is_number() ||
            !(hz->get<double>() >= 0.1 && hz->get<double>() <= ViewRequest::max_request_hz))
            refuse_message(fmt::format("view: max_hz: a number from 0.1 to {}", ViewRequest::max_request_hz));
        out.max_hz = hz->get<double>();
    }
    return out;
}

} // namespace

std::string to_text(const CameraId& camera) {
    return fmt::format("{}-{}", camera.pid, camera.number);
}

std::optional<CameraId> camera_id_of(std::string_view text) {
    CameraId id;
    const char* const end = text.data() + text.size();
    const auto [dash, bad_pid] = std::from_chars(text.data(), end, id.pid);
    if (bad_pid != std::errc{} || id.pid <= 0 || dash == end || *dash != '-') return std::nullopt;
    const auto [stop, bad_number] = std::from_chars(dash + 1, end, id.number);
    if (bad_number != std::errc{} || stop != end || id.number > 1000) return std::nullopt;
    return id;
}

ViewerMessage viewer_message_of(std::string_view text) {
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object() || json.size() != 1)
        refuse_message(R"(a message is {"token": TOKEN}, {"view": {...}} or {"ready": true})");
    ViewerMessage message;
    const std::string& kind = json.begin().key();
    const Json& value = json.begin().value();
    if (kind == "token") {
        if (!value.is_string() || value.get_ref<const std::string&>().size() > max_token_bytes)
            refuse_message(fmt::format("token: a text of at most {} bytes", max_token_bytes));
        message.token = value.get<std::string>();
    } else if (kind == "view") {
        message.view = requested_view(value);
    } else if (kind == "ready") {
        if (value != true) refuse_message("ready: true");
        message.ready = true;
    } else {
        refuse_message("allowed are token, view and ready");
    }
    return message;
}

std::array<unsigned char, picture_header_bytes>
picture_header(std::uint32_t camera, const transports::FrameRingHeader& frame, const View& view,
               std::uint32_t flags, std::uint32_t skipped, std::int64_t made_tai_ns) {
    std::array<unsigned char, picture_header_bytes> out{};
    const auto put = [&out](std::size_t at, std::size_t bytes, std::uint64_t value) {
        for (std::size_t i = 0; i < bytes; ++i)
            out[at + i] = static_cast<unsigned char>(value >> 8 * i);
    };
    std::memcpy(out.data(), "OBSV", 4);
    put(4, 2, 1);
    put(6, 2, picture_header_bytes);
    put(8, 4, camera);
    put(12, 4, flags);
    put(16, 8, frame.frame_id);
    put(24, 8, frame.trigger_id);
    put(32, 8, static_cast<std::uint64_t>(frame.edge_tai_ns));
    put(40, 2, view.x);
    put(42, 2, view.y);
    put(44, 2, view.width);
    put(46, 2, view.height);
    put(48, 2, view.bin);
    put(50, 1, view.reduce == Reduce::mean ? 1 : 0);
    put(52, 1, frame.bits);
    put(54, 2, frame.rows);
    put(56, 4, skipped);
    put(60, 2, frame.width);
    put(62, 2, frame.height);
    put(64, 8, frame.number);
    put(72, 8, static_cast<std::uint64_t>(made_tai_ns));
    return out;
}

std::string histogram_text(std::uint64_t frame_id, const Histogram& h) {
    // The id as text: numbers above 2^53 lose bits in browsers.
    return Json{{"histogram",
                 {{"frame", fmt::format("{}", frame_id)},
                  {"bins", h.bins},
                  {"saturated", h.saturated},
                  {"min", h.min},
                  {"max", h.max},
                  {"mean", h.mean},
                  {"p50", h.p50},
                  {"p99", h.p99}}}}
        .dump();
}

std::string reason_text(std::string_view kind, std::string_view why) {
    return Json{{std::string(kind), why}}.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace obscura::web
