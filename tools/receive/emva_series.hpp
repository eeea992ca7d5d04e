// SPDX-License-Identifier: Apache-2.0
// Reader of image series in the layout of the EMVA 1288 reference sets.
#pragma once

#include "sensors/emva1288.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {

/// Images taken under one illumination with one exposure time.
struct EmvaMeasurement {
    double exposure_ns = 0;
    double photons = 0; ///< mean number per pixel and exposure; 0: dark
    std::vector<std::filesystem::path> images;
};

/// Temporal statistics of a dark pair.
struct EmvaDarkPair {
    double exposure_ns = 0;
    sensors::emva1288::PairStatistics pair;
};

/// Pixels of the images as the descriptor states them and as the files hold them.
struct EmvaFormat {
    int bits = 0;
    std::int32_t width = 0, height = 0;
    int shift = 0; ///< empty low bits of 16-bit files whose values are left-aligned
};

struct EmvaSeries {
    std::filesystem::path descriptor;
    EmvaFormat format;
    /// Bright pairs with the dark statistics of their exposure time, in order of rising photon count.
    std::vector<sensors::emva1288::Level> levels;
    std::vector<EmvaMeasurement> bright_pairs; ///< images of `levels`, in the same order
    std::vector<EmvaDarkPair> dark;            ///< in order of rising exposure time
    std::vector<EmvaMeasurement> dark_pairs;   ///< images of `dark`, in the same order
    /// Stacks of three or more images, dark and bright, for the spatial statistics. They are no levels.
    std::vector<EmvaMeasurement> stacks;
    std::vector<std::string> notes; ///< what was left out or interpolated

    /// Dark statistics at an exposure time, interpolated between its neighbours if it was not measured: mean
    /// and variance of the dark signal are linear in the exposure time (release 4, section 3). Nothing
    /// outside the range of the dark pairs.
    [[nodiscard]] std::optional<sensors::emva1288::PairStatistics> dark_at(double exposure_ns) const;
    /// Adds the images of `measurement` to `stack`. Throws InputError.
    void add_images(const EmvaMeasurement& measurement, sensors::emva1288::ImageStack& stack) const;
    [[nodiscard]] sensors::emva1288::ImageStack stack(const EmvaMeasurement& measurement) const;
};

/// Reads a descriptor file, or EMVA1288_Data.txt of a folder, and the grey images that it names.
///
/// Descriptor: "n BITS WIDTH HEIGHT", "b EXPOSURE_NS PHOTONS" and "d EXPOSURE_NS", each of the latter two
/// followed by its images, "i FILE" with a path relative to the descriptor and either kind of slash; "v" and
/// "l" lines are ignored. Two images are a pair for temporal statistics; three or more are a stack for
/// spatial ones. A bright pair without a dark pair of its exposure time takes statistics interpolated
/// between the neighbouring exposure times; outside their range it is left out. Measurements whose images
/// are not all there are left out. Throws InputError with one line that names file and cause.
[[nodiscard]] EmvaSeries read_emva_series(const std::filesystem::path& folder_or_descriptor);

} // namespace obscura::tools
