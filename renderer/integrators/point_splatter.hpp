// SPDX-License-Identifier: Apache-2.0
// Point splatter: stars and sub-pixel bodies, projected and spread over pixels by the PSF.
#pragma once

#include "core/frame.hpp"
#include "core/region.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// One row of an image at one instant, and the sums to which points are added.
struct SplatTarget {
    Region window; ///< in sensor pixels
    std::int32_t y = 0;
    std::uint64_t frame_id = 0;
    std::uint32_t instant = 0, instants = 1; ///< index and number of the instants of the exposure
    const RowState& row;
    const Projection& lens;                ///< of the row: with aberration
    std::vector<double>& light;            ///< channels x window.width, in the tracer's units, sr
    std::vector<double>& starlight;        ///< bands x window.width, W/m2
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
    /// Fills `found` with the stars that may be visible in some of the rows.
    void find_stars(std::span<const RowTime> rows, std::vector<std::uint32_t>& found) const;
    /// Adds the row's bodies, and the stars `in_view`.
    void splat(const SplatTarget& target, std::span<const std::uint32_t> in_view, Tracer& tracer) const;

private:
    enum class SplatParts : std::uint8_t { all, core };
    /// Adds the light of a point to row `target.y`; `amount`: by channel.
    void splat_point(const SplatTarget& target, ImagePoint at, std::span<const double> amount,
                     SplatParts parts, std::vector<double>& light) const;
    void splat_body(const SplatTarget& target, std::int32_t body, Tracer& tracer) const;
    /// Adds the light of one part of a body's disc, by `samples` points. Occluders: `target.candidates`.
    void splat_disc(const SplatTarget& target, std::int32_t body, LitDisc::Part part, std::uint32_t samples,
                    Tracer& tracer) const;
    void splat_stars(const SplatTarget& target, std::span<const std::uint32_t> in_view, Tracer& tracer) const;

    const scene::Scene& scene_;
    const std::vector<BuiltBody>& bodies_;
    const Projection& lens_; ///< of the camera at rest
    const GaussianPsf& gaussian_psf_;
    const Psf* psf_;
    StarField stars_;
    std::uint64_t seed_;
};

} // namespace obscura::renderer
