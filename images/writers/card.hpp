// SPDX-License-Identifier: Apache-2.0
// Image metadata as named values (cards), independent of the file format.
#pragma once

#include "core/camera/frame.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::images {

/// One item of metadata. `key` follows FITS: at most 8 of A-Z, 0-9, - and _.
struct Card {
    std::string key;
    std::variant<bool, std::int64_t, double, std::string> value;
    std::string comment; ///< begins with the unit in brackets, as in FITS
};
using Cards = std::vector<Card>;

/// Card that tells whether a frame has a flag.
struct FlagCard {
    FrameFlag flag;
    std::string_view key, comment;
};
inline constexpr std::array flag_cards{
    FlagCard{frame_partial, "PARTIAL", "rows at the bottom are missing"},
    FlagCard{frame_late, "LATE", "a row was late"},
    FlagCard{frame_stalled, "STALLED", "a row was ready in time and left late"},
    FlagCard{frame_degraded, "DEGRADED", "a row is not of full quality"},
    FlagCard{frame_failed, "FAILED", "rendering failed, rows are black"},
    FlagCard{frame_pose_held, "POSEHELD", "a pose is not known for this time, the last one is shown"},
    FlagCard{frame_lag_unknown, "NOLAG", "image lag of the frame before is missing"},
};

/// Metadata of a frame: ids, times, settings and the poses of the ground truth. Reproducible: the same frame
/// gives the same cards, without wall-clock time.
[[nodiscard]] Cards frame_cards(const Frame& frame);

/// XPIXSZ, YPIXSZ, FOCALLEN, FX, FY, CX, CY and PIXCENTR; none if the intrinsics are not known (pitches of
/// 0).
[[nodiscard]] Cards intrinsics_cards(const Intrinsics& intrinsics);

/// WINDOWS and W<window>_<what>: the windows of a composed image and their readout flags.
[[nodiscard]] Cards window_cards(std::span<const FrameWindow> windows, std::span<const std::uint32_t> flags);

/// Q<what>: levels and errors of a frame that was rendered at quality levels; else none. Without its times.
[[nodiscard]] Cards quality_cards(const FrameQuality& quality);

/// SUN_<what>, CAM_<what> and B<body>_<what>: position of the Sun, poses of the camera and the bodies;
/// CAMAXES and QUATCONV: their conventions.
[[nodiscard]] Cards scene_cards(const GroundTruth& truth);

/// The value as text: strings unchanged, numbers in their shortest exact form.
[[nodiscard]] std::string card_text(const Card& card);

} // namespace obscura::images
