// SPDX-License-Identifier: Apache-2.0
// Convolution kernels of the PSF's wings: one radius interval each, on grids that double their cells.
#pragma once

#include "renderer/camera/psf.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// The wings as a sum of kernels, each from a smooth interval of radii on a grid whose cells are a fraction
/// of these: particle-mesh convolution (Hockney and Eastwood, Computer Simulation Using Particles, 8-3).
///
/// Light is deposited on the grid's nodes with linear weights; the convolved nodes are the coefficients of
/// cubic B-splines. The kernel is the one with the least mean square error for both, and keeps the flux. The
/// error is the part of the wings that the grid cannot hold: with a core of 16 px, rms over a ring, 0.5 % of
/// the glow of a disc of 12 px or more, 1.5 % of that of one of 3 px, 5 % of that of a point where the wings
/// begin. Rings of the PSF finer than the cells are averaged. Immutable; thread-safe.
class WingKernels {
public:
    /// Largest offset of a kernel along an axis, in cells.
    static constexpr std::int32_t reach = 20;
    static constexpr std::int32_t side = 2 * reach + 1;

    /// Kernels for the first `channels` bands of `psf`, which must have wings.
    WingKernels(const Psf& psf, std::size_t channels);

    [[nodiscard]] std::size_t levels() const { return kernels_.size(); }
    [[nodiscard]] std::size_t zones() const { return zones_; }
    [[nodiscard]] std::size_t channels() const { return channels_; }
    /// Distance of the nodes of a level, in pitches of the columns: a power of two. Node (i, j) is at (i, j)
    /// cells.
    [[nodiscard]] double cell_px(std::size_t level) const {
        return cell_px_ * static_cast<double>(1u << level);
    }
    /// Fractions of the light of a node that one pixel at the offsets (column, row) gets, side x side, row by
    /// row; 0 outside a disc of radius reach + 0.5.
    [[nodiscard]] const float* kernel(std::size_t level, std::size_t zone, std::size_t channel) const {
        return kernels_[level][zone * channels_ + channel].data();
    }

private:
    double cell_px_ = 1; ///< of level 0
    std::size_t zones_ = 1, channels_ = 1;
    std::vector<std::vector<std::vector<float>>> kernels_; ///< level, zone and channel
};

} // namespace obscura::renderer
