// SPDX-License-Identifier: Apache-2.0
#include "web/frame_file.hpp"

#include "core/error.hpp"
#include "images/writers/frame_writer.hpp"
#include "tools/support/answer_cards.hpp"
#include "web/problem.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

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

} // namespace

FrameFiles::~FrameFiles() {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

std::string FrameFiles::file(std::string_view format, const tools::CallClient::Answer& frame) {
    const std::span<const std::uint16_t> pixels = frame.numbers("pixels");
    const std::span<const std::size_t> shape = frame.shape("pixels");
    if (format == "raw") {
        const std::span<const std::byte> bytes = std::as_bytes(pixels);
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
    if (folder_.empty()) {
        std::string made = (std::filesystem::temp_directory_path() / "obscura-web-XXXXXX").string();
        if (::mkdtemp(made.data()) == nullptr)
            throw OutputError(fmt::format("{}: {}", made, std::strerror(errno)));
        folder_ = made;
    }
    const auto kind = *enum_named<images::FrameFormat>(format);
    const std::filesystem::path path = folder_ / images::frame_file_name(1, kind);
    images::write_picture(path, kind,
                          {static_cast<std::int32_t>(shape[1]), static_cast<std::int32_t>(shape[0]),
                           frame.head.value("bits", 16), pixels},
                          tools::cards_of_answer(frame.head));
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    if (!in) throw OutputError(fmt::format("{}: cannot be read back", path.string()));
    return std::move(text).str();
}

Response FrameFiles::response(std::string_view format, const std::string& camera,
                              const tools::CallClient::Answer& frame) {
    const std::span<const std::size_t> shape = frame.shape("pixels");
    if (shape.size() != 2 || frame.numbers("pixels").size() != shape[0] * shape[1])
        return problem(503, "daemon", "the daemon's frame has no pixels");
    const Json known = known_of(frame.head, shape[1], shape[0]);
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
    response.headers.emplace_back(
        "ETag", fmt::format("\"{}.{}.{}\"", camera, known["id"].get<std::string>(), format));
    if (format != "json")
        response.headers.emplace_back("Content-Disposition",
                                      fmt::format("attachment; filename=\"frame_{:0>6}.{}\"",
                                                  known["frame"].get<std::string>(), format));
    return response;
}

} // namespace obscura::web
