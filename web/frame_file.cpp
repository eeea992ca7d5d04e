// SPDX-License-Identifier: Apache-2.0
#include "web/frame_file.hpp"

#include "core/error.hpp"
#include "images/writers/frame_writer.hpp"
#include "tools/support/answer_cards.hpp"
#include "web/jpeg.hpp"
#include "web/problem.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

/// What GET latest.json answers; counts and instants as strings, since they may not fit a double.
Json known_of(const Json& head, std::size_t width, std::size_t height) {
    Json known = head;
    known["id"] = head.value("number", std::int64_t{0});
    known.erase("number");
    for (const char* name : {"id", "frame", "trigger", "edge_tai_ns", "mid_exposure_tai_ns"})
        known[name] = std::to_string(known.value(name, std::int64_t{0}));
    known["width"] = width;
    known["height"] = height;
    return known;
}

std::string jpeg_file(const KeptFrame& frame) {
    std::vector<std::uint64_t> counts;
    const std::vector<std::uint8_t> levels =
        preview_levels(frame.pixels, std::clamp(frame.head.value("bits", 16U), 8U, 16U), counts);
    const std::vector<unsigned char> bytes = jpeg_of(frame.pixels, frame.height, levels);
    if (bytes.empty())
        throw Refusal(
            422, "value",
            fmt::format("a frame of {} x {} pixels has no JPEG, allowed are up to {} columns and rows",
                        frame.width, frame.height, most_jpeg_side));
    return {bytes.begin(), bytes.end()};
}

} // namespace

FrameFiles::~FrameFiles() {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

std::string FrameFiles::file(std::string_view format, const KeptFrame& frame) {
    if (format == "raw") return {reinterpret_cast<const char*>(frame.pixels.data()), frame.bytes()};
    if (format == "jpg") return jpeg_file(frame);
    const std::lock_guard lock(mutex_);
    if (folder_.empty()) {
        std::string made = (std::filesystem::temp_directory_path() / "obscura-web-XXXXXX").string();
        if (::mkdtemp(made.data()) == nullptr)
            throw OutputError(fmt::format("{}: {}", made, std::strerror(errno)));
        folder_ = made;
    }
    const auto kind = *enum_named<images::FrameFormat>(format);
    const std::filesystem::path path = folder_ / images::frame_file_name(1, kind);
    images::write_picture(path, kind,
                          {static_cast<std::int32_t>(frame.width), static_cast<std::int32_t>(frame.height),
                           frame.head.value("bits", 16), frame.pixels},
                          tools::cards_of_answer(frame.head));
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    if (!in) throw OutputError(fmt::format("{}: cannot be read back", path.string()));
    return std::move(text).str();
}

Response FrameFiles::response(std::string_view format, const KeptFrame& frame) {
    const Json known = known_of(frame.head, frame.width, frame.height);
    Response response;
    if (format == "json")
        response = json_answer(known);
    else
        response.body = file(format, frame);
    constexpr std::array<std::pair<const char*, const char*>, 9> headers{
        {{"X-Obscura-Id", "id"},
         {"X-Obscura-Frame", "frame"},
         {"X-Obscura-Trigger", "trigger"},
         {"X-Obscura-Edge-TAI-ns", "edge_tai_ns"},
         {"X-Obscura-Width", "width"},
         {"X-Obscura-Height", "height"},
         {"X-Obscura-Bits", "bits"},
         {"X-Obscura-Rows", "rows"},
         {"X-Obscura-Flags", "flags"}}};
    for (const auto& [header, name] : headers) {
        const Json& value = known[name];
        response.headers.emplace_back(header, value.is_string() ? value.get<std::string>() : dumped(value));
    }
    // The edge tells frames of a process from those of an earlier one with its number.
    response.headers.emplace_back("ETag", fmt::format("\"{}.{}.{}.{}\"", to_text(frame.camera),
                                                      known["id"].get<std::string>(),
                                                      known["edge_tai_ns"].get<std::string>(), format));
    if (format != "json")
        response.headers.emplace_back("Content-Disposition",
                                      fmt::format("attachment; filename=\"frame_{:0>6}.{}\"",
                                                  known["frame"].get<std::string>(), format));
    return response;
}

} // namespace obscura::web
