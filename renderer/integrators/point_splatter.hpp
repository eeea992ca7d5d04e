// SPDX-License-Identifier: Apache-2.0
// Point splatter: stars and sub-pixel bodies, projected and spread over pixels by the PSF.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/region.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/integrators/star_rows.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/lit_disc.hpp"
#include "renderer/shapes/lit_facets.hpp"
#include "renderer/world/row_state.hpp"
#include "renderer/world/sky_sources.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::renderer {

/// One row of an image at one instant, and the sums to which points are added.
struct SplatTarget {
    Region window; ///< in sensor pixels
    std::int32_t y = 0;
    std::uint32_t instants = 1; ///< number of the instants of the exposure
    const RowState& row;
    const StarObserver& observer;
    double time_s;
    const Projection& lens;                ///< of the row: with aberration
    std::vector<double>& light;            ///< channels x window.width, in the tracer's units, sr
    std::vector<double>& starlight;        ///< bands x window.width, W/m2
    std::vector<std::int32_t>& candidates; ///< scratch space
};

/// Part of the samples of a small body at one instant of an exposure.
struct PointJob {
    std::int32_t body = 0;
    std::uint32_t instant = 0, instants = 1;
    std::uint32_t first = 0, count = 0, of = 0;
    std::uint32_t seed = 0;
    LitDisc::Part part = LitDisc::Part::lit; ///< of the disc
    bool of_facets = false;                  ///< samples `facets` instead, which the disc leaves out
    std::shared_ptr<const LitFacets> facets;
};

/// Points of the image, and the amounts of light by channel of each.
struct LightPoints {
    std::vector<ImagePoint> at;
    std::vector<double> amount;
};

/// Light of such samples.
struct BodyPoints {
    LightPoints points;
    /// Their image through the core of the PSF, channel by channel, where that is less than the points.
    std::vector<double> tile;
    std::int32_t tile_x = 0, tile_y = 0, tile_width = 0, tile_rows = 0;
    LightPoints wings; ///< the same light, in fewer points
};

/// Weights of a point's pixels along one axis, tabulated: linear between 256 positions in a pixel, which
/// keeps the light; of a Gaussian of 0.5 px they err by 4e-6 at most.
class SplatTable {
public:
    explicit SplatTable(const GaussianAxis& axis);

    [[nodiscard]] std::int32_t columns() const { return columns_; }
    /// First pixel that a point at `x` lights, of columns() in all; fills `weights` with theirs.
    std::int32_t weights(double x, std::vector<double>& weights) const;

private:
    static constexpr int positions = 256;
    std::int32_t columns_, before_;
    std::vector<double> table_;
};

/// Where the points of small bodies are wanted.
struct PointView {
    Region window;              ///< in sensor pixels
    std::int32_t first_y, rows; ///< rows of the sensor
    std::uint64_t frame_id;
    /// Rows that share their points with no other: fewer samples, with random numbers of their own.
    bool alone;
    const RowState& row;
    const Projection& lens;                ///< of the row: with aberration
    std::vector<std::int32_t>& candidates; ///< scratch space
};

/// Adds what pixel samples do not find: stars and sub-pixel bodies, and the light of thin crescents that
/// falls into the PSF's core. A point source gives each pixel its irradiance times the fraction of the PSF
/// there, so that flux is conserved from infinity to contact. Wings of larger bodies: see WingMap. Immutable;
/// thread-safe.
class PointSplatter {
public:
    /// All arguments but the seed must outlive the splatter. `psf`: replaces the Gaussian; may be null.
    /// Throws ConfigError if a star's numbers are not finite.
    PointSplatter(const scene::Scene& scene, const std::vector<BuiltBody>& bodies, const Projection& lens,
                  const GaussianPsf& gaussian_psf, const Psf* psf, std::uint64_t seed);

    /// Largest distance between a point's image and a pixel that it lights.
    [[nodiscard]] double reach_px() const {
        return psf_ != nullptr ? std::max(psf_->reach_px(), psf_->wings_reach_px())
                               : gaussian_psf_.splat_reach_px();
    }
    [[nodiscard]] const SkySources& sky() const { return sky_; }
    /// Finds the stars that rows may show.
    [[nodiscard]] StarRows star_rows() const { return {scene_, bodies_, lens_, stars_, reach_px()}; }
    /// Lists the samples of the bodies that may light the view's rows at an instant, after those in `jobs`.
    void plan_points(const PointView& view, std::uint32_t instant, std::uint32_t instants,
                     const Tracer& tracer, std::vector<PointJob>& jobs) const;
    /// Replaces `light` by that of the samples of a job.
    void trace_points(const PointView& view, const PointJob& job, Tracer& tracer, BodyPoints& light) const;
    /// Adds the light of a body's samples.
    void splat_body(const SplatTarget& target, const BodyPoints& light) const;
    /// Adds the stars `in_row`, indices into `stars`.
    void splat_stars(const SplatTarget& target, const FieldStars& stars,
                     std::span<const std::uint32_t> in_row, Tracer& tracer) const;
    /// Adds the sky objects that move or vary.
    void splat_sky(const SplatTarget& target, Tracer& tracer) const;

private:
    enum class SplatParts : std::uint8_t { all, core, wings };
    /// Largest distance of a pixel that the core of the PSF lights.
    [[nodiscard]] double core_reach_px() const {
        return psf_ != nullptr ? psf_->reach_px() : gaussian_psf_.splat_reach_px();
    }
    /// Adds a point source towards `direction` (unit, camera frame) if no body before it hides it.
    void splat_source(const SplatTarget& target, Vec3 direction, double distance_m,
                      std::span<const double> irradiance_w_m2, Tracer& tracer) const;
    /// Makes the tile of the points if that pays.
    void fill_tile(BodyPoints& light) const;
    /// Adds the light of a point to row `target.y`; `amount`: by channel.
    void splat_point(const SplatTarget& target, ImagePoint at, std::span<const double> amount,
                     SplatParts parts, std::vector<double>& light) const;

    const scene::Scene& scene_;
    const std::vector<BuiltBody>& bodies_;
    const Projection& lens_; ///< of the camera at rest
    const GaussianPsf& gaussian_psf_;
    const Psf* psf_;
    SplatTable across_, down_; ///< of the Gaussian
    StarField stars_;
    SkySources sky_;
    std::uint64_t seed_;
};

} // namespace obscura::renderer
