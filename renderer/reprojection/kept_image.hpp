// SPDX-License-Identifier: Apache-2.0
// Light of the bodies in a rendered frame, and where the camera saw them, kept for reprojection.
#pragma once

#include "core/geometry.hpp"
#include "core/region.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/reprojection/resample.hpp"
#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Poses of the camera and the bodies at one instant, as far as image points depend on them.
struct KeptView {
    struct Body {
        Mat3 from_camera; ///< as in BodyState
        Vec3 camera_m, sun_m;
    };
    Mat3 camera_from_inertial{};
    Vec3 beta{}; ///< see RowState
    std::vector<Body> bodies;

    void set(const RowState& row);
    /// Image point and weight (Projection::rays()) of a direction, camera axes at this instant.
    [[nodiscard]] std::optional<ImagePoint> project(const Projection& lens, Vec3 direction,
                                                    double& weight_sr) const;

    /// What has changed until another instant, of all bodies larger than pixels within `field_rad` of the
    /// boresight the most.
    struct Change {
        double motion_px = 0; ///< bound of the motion of any point in the image; infinite: not known
        double sun_rad = 0;   ///< direction of the Sun, as a body sees it
    };
    [[nodiscard]] Change change_to(const RowState& row, const Projection& lens, double field_rad) const;
};

/// Light of an area of the sensor without stars and sub-pixel bodies, in the channels and the unit of the
/// tracer. Different threads may keep different rows. Real-time safe but for more bodies or a larger area
/// than ever before.
class KeptImage {
public:
    /// Rows from one view to the next, where rows have different times.
    static constexpr std::int32_t view_rows = 16;

    /// Forgets all rows: those of `area` follow, of a scene with so many bodies.
    void begin(const Region& area, std::size_t channels, std::size_t bodies);
    [[nodiscard]] const Region& area() const { return area_; }
    [[nodiscard]] std::size_t channels() const { return channels_; }

    /// `one_time`: all rows of the area have the same middle of the exposure. One thread, before rows.
    void set_one_time(bool one_time) { one_time_ = one_time; }
    /// Whether the view at the middle of the exposure of row `y` of the sensor is wanted.
    [[nodiscard]] bool wants_view(std::int32_t y) const {
        return one_time_ ? y == area_.y : (y - area_.y) % view_rows == 0;
    }
    void set_view(std::int32_t y, const RowState& middle) {
        views_[static_cast<std::size_t>((y - area_.y) / view_rows)].set(middle);
    }
    /// Channels x width of the area.
    void keep_row(std::int32_t y, std::span<const double> light);
    /// Whether all rows are kept.
    [[nodiscard]] bool complete() const;

    /// Plane of channel `c`: rows of area().width.
    [[nodiscard]] const float* plane(std::size_t c) const {
        return light_.data() +
               c * static_cast<std::size_t>(area_.width) * static_cast<std::size_t>(area_.height);
    }
    /// Of each row, in all channels.
    [[nodiscard]] std::span<const LitColumns> lit() const {
        return std::span(lit_).first(static_cast<std::size_t>(area_.height));
    }

    /// The views about a row, and the share of the second one: beyond the ends, more than 1 or less than 0.
    struct Between {
        const KeptView *first, *second;
        double share;
    };
    [[nodiscard]] Between views_about(double y) const;

private:
    std::vector<float> light_;
    std::vector<LitColumns> lit_;
    std::vector<std::uint8_t> kept_;
    std::vector<KeptView> views_;
    Region area_{};
    std::size_t channels_ = 0;
    bool one_time_ = true;
};

} // namespace obscura::renderer
