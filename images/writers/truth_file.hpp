// SPDX-License-Identifier: Apache-2.0
// Ground truth of a frame per pixel and row, as a FITS file beside the frame.
#pragma once

#include "core/camera/frame.hpp"
#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace obscura::images {

/// File name of the ground truth of frame `number`, such as "truth_000042.fits".
[[nodiscard]] std::string truth_file_name(std::uint64_t number);

/// Writes the ground truth of a frame with pixel truth: the image of expected electrons before any noise,
/// with frame_cards() and `more`; the image SATURATED, 1 where the charge reached full well; and the tables
/// WINDOWS, ROWS (reset and read time of each row of the composed image) and HITS (particles; array pixels).
/// Times are ns of the scheduling clock, as in the cards. Throws OutputError.
/// `pixel_middles_ns`: where pixels have times of their own, the middle of the exposure of each, for an image
/// TIME; else empty.
void write_truth(const std::filesystem::path& file, const Frame& frame, const Cards& more = {},
                 std::span<const std::int64_t> pixel_middles_ns = {});

} // namespace obscura::images
