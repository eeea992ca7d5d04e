// SPDX-License-Identifier: Apache-2.0
// Radiometric curve of a screen: relative luminance of each drive level, and its inverse.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports {

/// One measured point of the curve.
struct CurvePoint {
    double level = 0;     ///< drive level
    double luminance = 0; ///< relative to the brightest level, 0..1
};

/// Luminance of every drive level, relative to the highest, and its inverse. Between two levels the inverse
/// is linear in luminance, because a pixel that dithers between level n (share 1-f) and n+1 (share f) shows
/// (1-f) L(n) + f L(n+1) on average: the mean brightness is then exact, whatever the curve's shape.
class RadiometricCurve {
public:
    /// Straight line from 0 to 1 over `levels` drive levels.
    explicit RadiometricCurve(int levels);
    /// Monotone cubic interpolation of measured points (Fritsch & Carlson 1980, slopes of Fritsch & Butland).
    /// Points must rise in level from 0 to levels - 1 and must not fall in luminance; the last is scaled
    /// to 1. Throws ConfigError otherwise.
    RadiometricCurve(int levels, std::span<const CurvePoint> points);

    [[nodiscard]] int levels() const { return static_cast<int>(luminance_.size()); }
    /// Relative luminance of a whole level.
    [[nodiscard]] double luminance(int level) const { return luminance_[static_cast<std::size_t>(level)]; }
    /// Fractional level, 0 .. levels - 1, that shows `luminance`, clamped to the range of the curve.
    [[nodiscard]] float drive(float luminance) const noexcept;

private:
    void index();
    std::vector<float> luminance_;
    std::vector<std::uint16_t> guide_; ///< cell of luminance -> level to start the search at
};

} // namespace obscura::transports
