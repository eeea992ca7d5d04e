// SPDX-License-Identifier: Apache-2.0
#include "tools/control/saved_frame.hpp"

#include "core/io/path_state.hpp"
#include "host/command_line.hpp"
#include "images/writers/pending_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace obscura::tools {
namespace {

constexpr std::string_view json_format = "json";

} // namespace

FrameNames::FrameNames(std::string_view verb, const std::string& output, const std::string& format,
                       bool several)
    : output_(output), is_folder_(output.ends_with('/') || is_folder_at(output)) {
    const std::string suffix = output_.extension().string();
    if (!is_folder_ && several)
        throw host::UsageError(fmt::format(
            "obscura {}: --output {}: for several frames a folder is wanted, as {}/ with a slash at its end",
            verb, output, output_.replace_extension().string()));
    // Said before a frame is waited for.
    if (const std::filesystem::path folder = output_.parent_path();
        !is_folder_ && !folder.empty() && !is_folder_at(folder))
        throw host::UsageError(
            fmt::format("obscura {}: --output {}: there is no folder {}", verb, output, folder.string()));
    const std::string wanted =
        is_folder_ ? (format.empty() ? "png" : format) : suffix.substr(suffix.empty() ? 0 : 1);
    if (!is_folder_ && !format.empty() && format != wanted)
        throw host::UsageError(
            fmt::format("obscura {}: --format {} does not fit --output {}", verb, format, output));
    format_ = enum_named<images::FrameFormat>(wanted);
    if (!format_ && wanted != json_format)
        throw host::UsageError(
            fmt::format("obscura {}: --output {}: allowed are files ending in .{}, .{}, or a folder", verb,
                        output, fmt::join(names_of_enum<images::FrameFormat>(), ", ."), json_format));
}

std::filesystem::path FrameNames::next(std::uint64_t frame_id) {
    if (!is_folder_) return output_;
    if (last_id_ == 0) images::make_writable(output_);
    if (frame_id <= last_id_) ++run_;
    last_id_ = frame_id;
    std::filesystem::path name =
        images::frame_file_name(frame_id, format_.value_or(images::FrameFormat::raw));
    if (!format_) name.replace_extension(json_format);
    return output_ / ((run_ > 1 ? fmt::format("run{}_", run_) : std::string()) + name.string());
}

} // namespace obscura::tools
