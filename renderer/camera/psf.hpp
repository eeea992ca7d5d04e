// SPDX-License-Identifier: Apache-2.0
// Point spread functions other than plain Gaussians: core, sampled by field position and band, and wings.
#pragma once

#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf_core.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::renderer {

struct PsfExtent;
struct PsfImage;
struct PsfTables;

/// Field positions about an image point, for which the PSF is given, and their weights.
struct PsfZones {
    std::size_t zone[4] = {};
    double share[4] = {1, 0, 0, 0};
};

/// PSF of a camera. Camera samples are displaced within its core, out to `reach_px()`; the wings beyond are
/// added point by point (PointSplatter) or by convolution (WingKernels). Immutable; thread-safe.
class Psf {
public:
    /// Null for a plain Gaussian: use GaussianPsf. A table of points alone becomes one in `camera`, of sigma
    /// 0. Throws ConfigError or InputError.
    static std::unique_ptr<const Psf> make(scene::Camera& camera, const std::vector<SpectralBand>& bands);

    /// Whether the PSF differs between bands.
    [[nodiscard]] bool chromatic() const { return chromatic_; }
    /// Largest displacement along an axis: half a pixel beyond the core.
    [[nodiscard]] double reach_px() const { return core_extent_px() + 0.5; }
    /// Radius of the core; the wings begin at half of it.
    [[nodiscard]] double core_px() const { return core_px_; }
    /// Radius of the wings; 0: none, all light is in the core.
    [[nodiscard]] double wings_px() const { return wings_px_; }
    /// Largest extent of the wings along an axis, in pixels.
    [[nodiscard]] double wings_reach_px() const { return wings_px_ * std::max(1.0, 1 / aspect_); }
    /// Pitch of the rows over that of the columns, which radii are in.
    [[nodiscard]] double aspect() const { return aspect_; }
    /// Squared distance, in pitches of the columns, of an offset in pixels.
    [[nodiscard]] double squared_distance(double dx, double dy) const {
        return dx * dx + aspect_ * dy * (aspect_ * dy);
    }
    /// Number of field positions.
    [[nodiscard]] std::size_t zones() const { return cores_.size(); }
    [[nodiscard]] PsfZones zones_at(double x, double y) const;

    /// Displaces samples of the pixels (x, y) by the PSF core; `weight`: sample weight in each channel.
    void displace(const Doubles& u, const Doubles& v, std::size_t channels, Doubles& x, Doubles& y,
                  Channels& weight) const;
    /// Fraction of the light of a point at `at` that the core brings into a pixel.
    [[nodiscard]] double weight(ImagePoint at, std::int32_t column, std::int32_t row, std::size_t band) const;
    /// Centroid of the core's light of a point at `at`, from the point, px; `weights`: signal of the point in
    /// each band.
    [[nodiscard]] ImagePoint centroid(ImagePoint at, std::span<const double> weights) const;
    /// Fraction of the light of a point at one field position that the wings bring into a pixel at a
    /// distance, see squared_distance().
    [[nodiscard]] double wing(std::size_t zone, std::size_t band, double squared_distance_px) const;
    /// As above, for a point between the field positions.
    [[nodiscard]] double wing(const PsfZones& at, std::size_t band, double squared_distance_px) const {
        double sum = 0;
        for (int k = 0; k < 4; ++k)
            if (at.share[k] > 0) sum += at.share[k] * wing(at.zone[k], band, squared_distance_px);
        return sum;
    }

private:
    Psf() = default;

    /// Adds all field positions of the images of a file. Throws ConfigError or InputError.
    void add_images(const std::vector<PsfImage>& images, const std::string& file, std::size_t bands);
    /// Adds the field positions of the model of `camera`: one in the middle if it is the same everywhere,
    /// else 5 x 5 over the sensor, between which it is linear. Throws ConfigError.
    void add_model(const scene::Camera& camera, const std::vector<SpectralBand>& bands);
    /// Adds the next field position.
    void add_zone(PsfTables tables);
    [[nodiscard]] PsfExtent extent() const;
    /// Largest extent of the core along an axis.
    [[nodiscard]] double core_extent_px() const { return core_px_ * std::max(1.0, 1 / aspect_); }

    double core_px_ = 0, wings_px_ = 0; ///< radii, in pitches of the columns
    double aspect_ = 1;                 ///< pitch of the rows over that of the columns
    bool chromatic_ = false;
    std::vector<double> field_x_, field_y_; ///< field positions, increasing
    std::vector<PsfCore> cores_;            ///< row by row
    /// Per field position and band, by the logarithm of the squared distance.
    std::vector<std::vector<std::vector<float>>> wings_;
};

} // namespace obscura::renderer
