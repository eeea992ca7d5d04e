// SPDX-License-Identifier: Apache-2.0
// 8-bit previews with stretched contrast and marked windows, for viewing only.
#pragma once

#include "core/region.hpp"
#include "tools/support/command_line.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

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
    /// Of the finite values of an image; full scale is the largest.
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

/// Writes stretched(image) as an 8-bit PNG. Throws OutputError.
void write_preview(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   const std::vector<float>& image, const Stretch& stretch);

/// Digital numbers of a frame and its windows, in pixels of the frame; no windows: the whole frame is one.
struct FramePreview {
    std::int32_t width = 0, height = 0;
    int bits = 16;
    std::span<const std::uint16_t> pixels; ///< row-major
    std::vector<Region> windows;
};

/// Writes a preview of a frame: grey, or in colour with marked windows (orange outlines) and padding (blue
/// stripes) where the windows do not fill the frame or are several. Padding does not count for the contrast.
/// Throws OutputError.
void write_preview(const std::filesystem::path& file, const FramePreview& frame, const Stretch& stretch);

/// Options --stretch and --gamma.
struct StretchOptions {
    std::string text = "auto";
    double gamma = 1;

    /// `of`: beginning of the help text, such as "Contrast of the previews".
    void declare(CommandLine& line, const std::string& of);
    /// Throws UsageError.
    [[nodiscard]] Stretch parsed(std::string_view verb) const { return Stretch::parse(verb, text, gamma); }
};

} // namespace obscura::tools
