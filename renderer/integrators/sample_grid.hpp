// SPDX-License-Identifier: Apache-2.0
// Shared sample grid: one camera ray per pixel, filtered by the PSF; for smooth regions.
#pragma once

#include "core/camera/region.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/packets/packet.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Position of the grid in one frame, and the weights of its points in a pixel. The points are the centres of
/// the pixels, all displaced by one random shift; a pixel is the sum of the points about it times its
/// response there. The weights of each axis sum to 1 for any shift, because the response of a pixel
/// sums to 1 over any grid of its own pitch; images without detail finer than two pixels lose nothing.
struct SampleGridKernel {
    static constexpr std::int32_t max_reach = 4;

    double shift_x = 0, shift_y = 0; ///< px, -0.5 .. 0.5
    std::int32_t reach = 0;          ///< points from -reach to reach about a pixel are summed
    double x[2 * max_reach + 1] = {}, y[2 * max_reach + 1] = {};
    /// Standard deviation in a pixel over that of points which are equal along the other axis, as on an edge.
    double noise = 1;
    /// Variance of a pixel over that of points whose errors are independent: sum of the squared weights.
    double independent = 1;

    /// Does not throw; a PSF too narrow or too wide has no kernel: see fits().
    SampleGridKernel(const GaussianPsf& psf, std::uint64_t seed, std::uint64_t frame_id);
    [[nodiscard]] static bool fits(const GaussianPsf& psf);
};

/// Bodies near 16 pixels of a row, found by projection before any ray is traced.
struct NearBodies {
    std::uint16_t covered = 0; ///< bit i: a body may be seen in pixel i
    std::uint32_t samples = 0; ///< per pixel, as the bodies require; 0: no body is near
    bool large = true;         ///< all bodies near are BodyState::large
    bool small = false;        ///< some body near is BodyState::small
    double reference = 0;      ///< brightest of the bodies' reference radiances
};

/// Local roughness of 16 points, over the 3 x 3 points about each.
struct GridRoughness {
    Doubles deviation; ///< standard deviation from their mean
    Doubles residual;  ///< standard deviation from the plane fitted through them
    /// Variance of independent noise: the square of the second difference along rows of that along columns,
    /// over its sum of squared weights, 36 (Immerkaer, CVIU 64(2), 1996). Edges along an axis leave nothing.
    Doubles noise2;
};

/// Radiance times solid angle of the grid's points over a window and the kernel's reach beyond it. Rows may
/// be filled by different threads.
class SampleGrid {
public:
    /// Sets all to 0. Columns are whole blocks of 16, as packets are.
    void reset(const Region& window, std::int32_t first_row, std::int32_t rows, std::size_t channels,
               std::int32_t reach);

    [[nodiscard]] std::int32_t first_x() const { return first_x_; }
    [[nodiscard]] std::int32_t first_y() const { return first_y_; }
    [[nodiscard]] std::int32_t width() const { return width_; }
    [[nodiscard]] std::int32_t height() const { return height_; }
    [[nodiscard]] float* row(std::size_t channel, std::int32_t y) {
        return values_.data() +
               (channel * static_cast<std::size_t>(height_) + static_cast<std::size_t>(y - first_y_)) *
                   static_cast<std::size_t>(width_);
    }
    [[nodiscard]] const float* row(std::size_t channel, std::int32_t y) const {
        return values_.data() +
               (channel * static_cast<std::size_t>(height_) + static_cast<std::size_t>(y - first_y_)) *
                   static_cast<std::size_t>(width_);
    }

    /// Bodies near the block of row `y` that begins at column `x`.
    [[nodiscard]] NearBodies& near(std::int32_t x, std::int32_t y) { return near_[near_index(x, y)]; }
    [[nodiscard]] const NearBodies& near(std::int32_t x, std::int32_t y) const {
        return near_[near_index(x, y)];
    }

    /// Filters the grid to the pixels [x, x + 16) of row `y` in one channel.
    void gather(const SampleGridKernel& kernel, std::size_t channel, std::int32_t x, std::int32_t y,
                Doubles& value) const;
    /// Roughness of the mean over the channels about the pixels [x, x + 16) of row `y`.
    [[nodiscard]] GridRoughness roughness(std::size_t channels, std::int32_t x, std::int32_t y) const;

private:
    [[nodiscard]] std::size_t near_index(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>((y - first_y_) * (width_ / packet_size) +
                                        (x - first_x_) / packet_size);
    }

    std::vector<float> values_;
    std::vector<NearBodies> near_;
    std::int32_t first_x_ = 0, first_y_ = 0, width_ = 0, height_ = 0;
};

} // namespace obscura::renderer
