// SPDX-License-Identifier: Apache-2.0
#include "tools/support/preview.hpp"

#include "images/writers/png.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::tools {

std::vector<std::uint8_t> stretched(const std::vector<float>& image) {
    if (image.empty()) return {};
    std::vector<float> sorted = image;
    const auto at = [&](double part) {
        const auto index = static_cast<std::ptrdiff_t>(part * static_cast<double>(sorted.size() - 1));
        std::nth_element(sorted.begin(), sorted.begin() + index, sorted.end());
        return static_cast<double>(sorted[static_cast<std::size_t>(index)]);
    };
    const double black = at(0.05);
    double white = at(0.9999);
    // A star field has fewer bright pixels than that.
    if (!(white > black)) white = *std::max_element(image.begin(), image.end());
    if (!(white > black)) white = black + 1;
    // Mix mostly display gamma, which keeps the shading of a body, with some logarithm for faint stars.
    constexpr double faint = 1e-3;
    const double norm = std::asinh(1 / faint);
    const auto tone = [&](double x) {
        return 0.8 * std::pow(x, 1 / 2.2) + 0.2 * std::asinh(x / faint) / norm;
    };
    std::vector<std::uint8_t> out;
    out.reserve(image.size());
    for (const float value : image) {
        const double x = std::clamp((static_cast<double>(value) - black) / (white - black), 0.0, 1.0);
        out.push_back(static_cast<std::uint8_t>(std::lround(255 * tone(x))));
    }
    return out;
}

void write_preview(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   const std::vector<float>& image) {
    images::write_png8(file, width, height, stretched(image), {});
}

} // namespace obscura::tools
