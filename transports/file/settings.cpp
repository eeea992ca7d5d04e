// SPDX-License-Identifier: Apache-2.0
#include "transports/file/settings.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "transports/file/file_sink.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

namespace obscura::transports {
namespace {

/// Entries of a frame's truth table; further ones are left out.
constexpr std::size_t truth_entries_kept = 8192;

} // namespace

config::Section section_of(FileSinkSettings& s) {
    using config::key;
    return {
        .name = FileSinkSettings::kind,
        .help = "Transport that writes every frame to a file.",
        .keys =
            {
                key("enabled", &s.enabled).help("Write every frame to a file"),
                key("directory", config::Path{&s.directory, false})
                    .help("Folder for the files; created where it does not exist"),
                key("format", &s.format).help("File format of the frames"),
                key("queue_frames", &s.queue_frames)
                    .range(1, 256)
                    .help("Frames that may wait for the disk; further ones are dropped and counted"),
                key("truth", &s.truth)
                    .help(
                        "Also write the ground truth of each frame as truth_NNNNNN.fits: electrons before noise, saturated pixels, row times, particle hits"),
                key("truth_table", &s.truth_table)
                    .help(
                        "Also write where every star, body, landmark, limb and terminator is in the pixels of each frame into truth.csv beside the frames (docs/truth.md)"),
            },
        .check =
            [&s](const config::ReadTable& table) {
                const auto folder =
                    table.has("directory") ? std::filesystem::path() : table.where().file.parent_path();
                s.directory = absolute_path(folder / s.directory).string();
            },
    };
}

std::vector<Identity> identities_of(const FileSinkSettings& s) {
    return {{"directory", s.directory, s.directory, "folder"}};
}

std::size_t frames_held_by(const FileSinkSettings& s) {
    return s.queue_frames;
}

KeptTruth truth_wanted_by(const FileSinkSettings& s) {
    return {.pixels = s.truth, .scene_entries = s.truth_table ? truth_entries_kept : 0};
}

std::unique_ptr<Transport> make_transport(const FileSinkSettings& s, const TransportContext& context) {
    std::error_code error;
    std::filesystem::create_directories(s.directory, error);
    if (error)
        throw OutputError(fmt::format("{}: file.directory: cannot make {}: {}", context.configuration,
                                      s.directory, error.message()),
                          error.value());
    return std::make_unique<FileSink>(s);
}

} // namespace obscura::transports
