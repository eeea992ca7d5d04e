// SPDX-License-Identifier: Apache-2.0
// Point spread functions other than plain Gaussians: core, sampled by field position and band, and wings.
#pragma once

#include "renderer/camera/projection.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <memory>
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

private:
    std::int32_t side_ = 0; ///< points of the response
    double reach_px_ = 0;
    std::vector<std::vector<float>> response_; ///< one for all bands when they are the same
    std::vector<std::vector<float>> ratio_;    ///< band, cell; none when the bands are the same
    std::vector<double> light_;
    std::vector<double> row_sums_;   ///< cumulative, of the rows of cells
    std::vector<float> column_sums_; ///< cumulative within each row
};

/// PSF of a camera. Camera samples are displaced within its core, out to `reach_px()`; the wings beyond are
/// added source by source. Immutable; thread-safe.
class Psf {
public:
    /// Null for a plain Gaussian: use GaussianPsf. Throws ConfigError or InputError.
    static std::unique_ptr<const Psf> make(const scene::Camera& camera,
                                           const std::vector<SpectralBand>& bands);

    /// Whether the PSF differs between bands.
    [[nodiscard]] bool chromatic() const { return chromatic_; }
    /// Largest displacement along an axis: half a pixel beyond the core.
    [[nodiscard]] double reach_px() const { return core_px_ + 0.5; }
    /// Radius of the wings; 0: none, all light is in the core.
    [[nodiscard]] double wings_px() const { return wings_px_; }

    /// Displaces samples of the pixels (x, y) by the PSF core; `weight`: sample weight in each channel.
    void displace(const Doubles& u, const Doubles& v, std::size_t channels, Doubles& x, Doubles& y,
                  Channels& weight) const;
    /// Fraction of the light of a point at `at` that the core brings into a pixel.
    [[nodiscard]] double weight(ImagePoint at, std::int32_t column, std::int32_t row, std::size_t band) const;
    /// Fraction of the light of a point that the wings bring into a pixel at a distance.
    [[nodiscard]] double wing(std::size_t band, double squared_distance_px) const;

private:
    Psf() = default;
    /// The four field positions about a point, and their weights.
    struct Mix {
        const PsfCore* core[4];
        double share[4];
    };
    [[nodiscard]] Mix mix(double x, double y) const;

    double core_px_ = 0, wings_px_ = 0;
    bool chromatic_ = false;
    std::vector<double> field_x_, field_y_; ///< field positions, increasing
    std::vector<PsfCore> cores_;            ///< row by row
    std::vector<std::vector<float>> wings_; ///< per band, by the logarithm of the squared distance
};

} // namespace obscura::renderer
