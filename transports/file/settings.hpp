// SPDX-License-Identifier: Apache-2.0
// Settings of the file transport: section [file], its checks and its maker.
#pragma once

#include "images/writers/frame_writer.hpp"
#include "images/writers/shared_cards.hpp"
#include "transports/transport_settings.hpp"

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports {

/// Section [file]: where frames are stored, in which format, and how many may wait.
struct FileSinkSettings {
    static constexpr std::string_view kind = "file";

    bool enabled = false;
    std::string directory = "frames"; ///< must exist when FileSink::start() is called
    images::FrameFormat format = images::FrameFormat::png;
    std::size_t queue_frames = 4; ///< frames that may wait; further ones are dropped and counted
    bool truth = false;           ///< also write truth_<frame id>.fits for frames with pixel truth
    bool truth_table = false;     ///< also write truth.csv for frames with truth tables
    /// Cards of the camera, added to those of every frame; null: none. No key: the daemon sets it.
    std::shared_ptr<const images::SharedCards> camera_cards{};
};

/// Section bound to `settings`. A relative directory is resolved from the folder of the configuration file.
[[nodiscard]] config::Section section_of(FileSinkSettings& settings);
/// The folder: two cameras must not write to the same.
[[nodiscard]] std::vector<Identity> identities_of(const FileSinkSettings& settings);
/// Capacity of the queue.
[[nodiscard]] std::size_t frames_held_by(const FileSinkSettings& settings);
/// What the truth files need.
[[nodiscard]] KeptTruth truth_wanted_by(const FileSinkSettings& settings);
/// Creates the directory and a FileSink, not started. Throws OutputError.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const FileSinkSettings& settings,
                                                        const TransportContext& context);

} // namespace obscura::transports
