// SPDX-License-Identifier: Apache-2.0
// Stars of a block of rows: those near the field of view, and for each row those that may light it.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/region.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Time and place of the camera among the stars. Without an epoch of the scene stars stay where they are at
/// J2000.0. Parallaxes are those from the Sun: within 1 % of those from the barycentre at 1 au.
[[nodiscard]] StarObserver star_observer(const scene::Scene& scene, Vec3 camera_m, double time_s);

/// Result and working memory of StarRows, kept between blocks.
struct StarsInView {
    FieldStars stars;
    /// Indices into `stars` of the stars that may light row `r` of the block, ascending.
    [[nodiscard]] std::span<const std::uint32_t> in_row(std::size_t r) const {
        return std::span(of_rows).subspan(first[r], first[r + 1] - first[r]);
    }

    std::vector<std::uint32_t> first, of_rows;

    /// A star, and the rows of the sensor that its light may fall on.
    struct Near {
        std::uint32_t star;
        double from_y, to_y;
    };
    /// Camera of a row.
    struct RowPose {
        Quat attitude;       ///< at its middle
        double turn_rad = 0; ///< largest turn from there during the exposure
    };
    std::vector<Near> near;
    std::vector<RowPose> poses;
    /// What `stars` was made for.
    ephemeris::SkyCells::Cone cone{};
    StarObserver observer;
    bool known = false;
};

/// Immutable; thread-safe.
class StarRows {
public:
    /// All must outlive it. `reach_px`: largest distance between a star's image and a pixel that it lights.
    StarRows(const scene::Scene& scene, const std::vector<BuiltBody>& bodies, const Projection& lens,
             const StarField& field, double reach_px)
        : scene_(scene), bodies_(bodies), lens_(lens), field_(field), reach_px_(reach_px) {}

    /// Fills StarsInView::stars with those that may be visible in some of the rows.
    void find(std::span<const RowTime> rows, StarsInView& view) const;
    /// As find(), for a camera that need not stand as the scene has it: turned by up to `more_rad`.
    void find(const Pose& camera, double more_rad, double time_s, StarsInView& view) const;
    /// As find(), and assigns the stars to the rows. `window`: in sensor pixels, of which the rows begin with
    /// `first_y`; `one_line`: all of them are that row, at different times.
    void assign(std::span<const RowTime> rows, const Region& window, std::int32_t first_y, bool one_line,
                StarsInView& view) const;

private:
    struct Block;
    void split(const Block& block, std::size_t first_row, std::size_t end_row, std::size_t first_near,
               StarsInView& view) const;

    const scene::Scene& scene_;
    const std::vector<BuiltBody>& bodies_;
    const Projection& lens_;
    const StarField& field_;
    double reach_px_;
};

} // namespace obscura::renderer
