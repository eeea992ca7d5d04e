// SPDX-License-Identifier: Apache-2.0
#include "web/api/frame_file.hpp"

#include "core/camera/frame_record.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/spectral_band.hpp"
#include "host/answer_cards.hpp"
#include "host/irradiance_image.hpp"
#include "images/writers/exr.hpp"
#include "images/writers/frame_writer.hpp"
#include "web/api/route_table.hpp"
#include "web/live/jpeg.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
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
    const auto as_text = [&known](const std::string& name) {
        known[name] = std::to_string(known.value(name, std::int64_t{0}));
    };
    as_text("id");
    for (const RecordField<FrameAnswer>& field : record_fields<FrameAnswer>())
        if (field.form == FieldForm::u64 || field.form == FieldForm::i64) as_text(std::string(field.member));
    known["width"] = width;
    known["height"] = height;
    return known;
}

/// `whole`: the frame of which `frame` is a part.
std::string jpeg_file(const KeptFrame& frame, const KeptFrame& whole) {
    std::vector<std::uint64_t> counts;
    const std::vector<std::uint8_t> levels =
        preview_levels(whole.pixels, std::clamp(frame.head.value("bits", 16U), 8U, 16U), counts);
    const std::vector<unsigned char> bytes = jpeg_of(frame.pixels, frame.height, levels);
    if (bytes.empty())
        throw Refusal(
            422, "value",
            fmt::format("a frame of {} x {} pixels has no JPEG, allowed are up to {} columns and rows",
                        frame.width, frame.height, max_jpeg_side));
    return {bytes.begin(), bytes.end()};
}

/// What a view that is not of all pixels shows of a frame.
KeptFrame part_of(const KeptFrame& frame, const View& view) {
    KeptFrame part{frame.camera, frame.number, frame.head, view.columns(), view.rows(), {}};
    part.pixels = reduced(frame.pixels, static_cast<std::uint32_t>(frame.width), view);
    return part;
}

std::string text_of(const View& view) {
    return fmt::format("{},{},{},{},{},{}", view.x, view.y, view.width, view.height, view.bin,
                       name_of(view.reduce));
}

} // namespace

FrameFiles::~FrameFiles() {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

std::string FrameFiles::made(const std::string& name,
                             const std::function<void(const std::filesystem::path&)>& write) {
    const std::lock_guard lock(mutex_);
    if (folder_.empty()) {
        std::string name_of_folder = (temporary_files_folder() / "obscura-web-XXXXXX").string();
        if (::mkdtemp(name_of_folder.data()) == nullptr)
            throw OutputError(fmt::format("{}: {}", name_of_folder, std::strerror(errno)), errno);
        folder_ = name_of_folder;
    }
    const std::filesystem::path path = folder_ / name;
    write(path);
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    if (!in) throw OutputError(fmt::format("{}: cannot be read back", path.string()), errno);
    return std::move(text).str();
}

std::string FrameFiles::file(std::string_view format, const KeptFrame& frame) {
    if (format == "raw") return {reinterpret_cast<const char*>(frame.pixels.data()), frame.bytes()};
    const auto kind = *enum_named<images::FrameFormat>(format);
    return made(images::frame_file_name(1, kind), [&](const std::filesystem::path& path) {
        images::write_picture(path, kind,
                              {static_cast<std::int32_t>(frame.width),
                               static_cast<std::int32_t>(frame.height), frame.head.value("bits", 16),
                               frame.pixels},
                              host::cards_of_answer(frame.head));
    });
}

Response FrameFiles::irradiance(const CameraId& camera, const Json& head, std::span<const float> values,
                                std::size_t height, std::size_t width) {
    std::vector<SpectralBand> bands;
    for (const Json& band : head.at("bands")) {
        const auto& limits = band.at("wavelength_nm");
        bands.push_back({1e-9 * limits.at(0).get<double>(), 1e-9 * limits.at(1).get<double>()});
    }
    if (bands.empty() || values.size() != bands.size() * height * width)
        throw Refusal(503, "daemon", "the daemon's irradiance is not of its bands");
    Response response;
    response.body = made("irradiance.exr", [&](const std::filesystem::path& path) {
        images::write_exr(path, static_cast<std::int32_t>(width), static_cast<std::int32_t>(height),
                          host::irradiance_channels(values, bands), host::cards_of_answer(head));
    });
    const std::string frame = std::to_string(head.at("frame").get<std::uint64_t>());
    const std::string edge = std::to_string(head.at("edge_tai_ns").get<std::int64_t>());
    response.headers = {
        {"X-Obscura-Frame", frame},
        {"X-Obscura-Edge-TAI-ns", edge},
        {"ETag", fmt::format("\"{}.{}.{}.exr\"", to_text(camera), frame, edge)},
        {"Content-Disposition", fmt::format("attachment; filename=\"irradiance_{:0>6}.exr\"", frame)}};
    return response;
}

Response FrameFiles::response(std::string_view format, const KeptFrame& frame, const View& wanted) {
    const View view =
        clipped(wanted, static_cast<std::uint32_t>(frame.width), static_cast<std::uint32_t>(frame.height));
    const bool is_whole = view.bin == 1 && view.width == frame.width && view.height == frame.height;
    const std::optional<KeptFrame> part = is_whole ? std::nullopt : std::optional(part_of(frame, view));
    const KeptFrame& shown = part ? *part : frame;
    const Json known = known_of(frame.head, shown.width, shown.height);
    Response response;
    if (format == "json")
        response = json_answer(known);
    else
        response.body = format == "jpg" ? jpeg_file(shown, frame) : file(format, shown);
    for (const FrameForm& form : frame_forms())
        if (response.type.empty() && form.suffix == format) response.type = form.type;
    const auto add_header = [&](std::string_view header, std::string_view name) {
        const Json value = known.value(std::string(name), Json());
        if (value.is_null()) return;
        response.headers.emplace_back(fmt::format("X-Obscura-{}", header),
                                      value.is_string() ? value.get<std::string>() : dumped(value));
    };
    add_header("Id", "id");
    for (const RecordField<FrameAnswer>& field : record_fields<FrameAnswer>())
        if (!field.header.empty()) add_header(field.header, field.member);
    add_header("Width", "width");
    add_header("Height", "height");
    add_header("Rows", "rows");
    add_header("Flags", "flags");
    // The edge tells frames of a process from those of an earlier one with its number.
    response.headers.emplace_back("ETag", fmt::format("\"{}.{}.{}.{}{}\"", to_text(frame.camera),
                                                      known["id"].get<std::string>(),
                                                      known["edge_tai_ns"].get<std::string>(),
                                                      is_whole ? "" : text_of(view) + ".", format));
    if (!is_whole) response.headers.emplace_back("X-Obscura-View", text_of(view));
    if (format != "json")
        response.headers.emplace_back("Content-Disposition",
                                      fmt::format("attachment; filename=\"frame_{:0>6}.{}\"",
                                                  known["frame"].get<std::string>(), format));
    return response;
}

} // namespace obscura::web
