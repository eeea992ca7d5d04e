// SPDX-License-Identifier: Apache-2.0
// Core of a point spread function: the response of pixels as a table, sampled and weighted by band.
#pragma once

#include "renderer/camera/projection.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Response of a pixel to a point source beside it, as a table, for all bands at one field position.
/// Distances are from the point to the centre of the pixel.
class PsfCore {
public:
    static constexpr std::int32_t per_pixel = 8; ///< table points per pixel

    /// `psf[band]`: light per px^2 on a square grid of (2 half + 1)^2 points, row by row.
    PsfCore(std::int32_t half, const std::vector<std::vector<double>>& psf);

    /// Samples a displacement from the mean over the bands; `cell`: argument of weight().
    void sample(double u, double v, double& x, double& y, std::size_t& cell) const;
    /// Sample weight of a band: its response over the pdf of the mean, which integrates to 1.
    [[nodiscard]] double weight(std::size_t band, std::size_t cell) const {
        return ratio_.empty() ? light_[band] : ratio_[band][cell];
    }
    [[nodiscard]] double response(std::size_t band, double x, double y) const;
    /// Fraction of the light that is in the core.
    [[nodiscard]] double light(std::size_t band) const { return light_[band]; }
    /// Centroid of that light from the point, px.
    [[nodiscard]] ImagePoint centroid(std::size_t band) const { return centroid_[band]; }

private:
    /// Adds the response of a band, its light and its centroid.
    void add_band(std::int32_t half, const std::vector<double>& grid);
    /// Response of pixels to a grid of points.
    [[nodiscard]] std::vector<float> integrated(std::int32_t half, const std::vector<double>& grid) const;
    /// Sets the cumulative sums of the mean over the bands, and their ratios to it.
    void set_sums();
    /// Mean of a response over cell (i, j).
    [[nodiscard]] double cell_mean(const std::vector<float>& response, std::size_t i, std::size_t j) const;

    std::int32_t side_ = 0; ///< points of the response
    double reach_px_ = 0;
    std::vector<std::vector<float>> response_; ///< one for all bands when they are the same
    std::vector<std::vector<float>> ratio_;    ///< band, cell; none when the bands are the same
    std::vector<double> light_;
    std::vector<ImagePoint> centroid_;
    std::vector<double> row_sums_;   ///< cumulative, of the rows of cells
    std::vector<float> column_sums_; ///< cumulative within each row
};

} // namespace obscura::renderer
