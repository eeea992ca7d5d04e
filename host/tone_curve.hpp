// SPDX-License-Identifier: Apache-2.0
// Contrast stretch of pictures to look at: tone curve and display levels.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace obscura::host {

enum class StretchKind : std::uint8_t { automatic, linear, percentile, asinh, logarithm };

/// Contrast stretch, as --stretch and --gamma state it.
struct Stretch {
    StretchKind kind = StretchKind::automatic;
    /// linear: black and white (empty: 0 and full scale); percentile: both percentages; asinh: softening;
    /// logarithm: range.
    std::vector<double> parameters;
    double gamma = 1; ///< display levels are raised to 1 / gamma

    /// Parses "KIND" or "KIND:PARAMETERS". Throws UsageError.
    [[nodiscard]] static Stretch parse(std::string_view verb, std::string_view text, double gamma);
};

/// Map from pixel values to display levels, 0 black to 1 white.
class ToneCurve {
public:
    /// `quantile`: value that the given share of the pixels does not exceed; `full_scale`: largest value that
    /// a pixel can have.
    ToneCurve(const Stretch& stretch, const std::function<double(double)>& quantile, double full_scale);
    /// Curve for the finite values of an image; full scale is the largest.
    ToneCurve(const Stretch& stretch, const std::vector<float>& image);

    [[nodiscard]] double level(double value) const;
    [[nodiscard]] double black() const { return black_; }
    [[nodiscard]] double white() const { return white_; }

private:
    StretchKind kind_;
    double black_ = 0, white_ = 1, parameter_ = 0, gamma_ = 1;
};

/// Display levels 0 to 255 of an image. NaN is black. Not for measurement.
[[nodiscard]] std::vector<std::uint8_t> stretched(const std::vector<float>& image, const Stretch& stretch);

/// Display level, 0 to 255, of each of the 65536 digital numbers, of which an image of that number of bits
/// has `counts`.
[[nodiscard]] std::vector<std::uint8_t> display_levels(std::span<const std::uint64_t> counts, int bits,
                                                       const Stretch& stretch);

} // namespace obscura::host
