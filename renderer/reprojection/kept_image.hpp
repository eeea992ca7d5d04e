// SPDX-License-Identifier: Apache-2.0
// Light of the bodies in a rendered frame, and where the camera saw them, kept for reprojection.
#pragma once

#include "core/camera/region.hpp"
#include "core/geometry.hpp"
#include "core/time.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/reprojection/kept_window.hpp"
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
        Vec3 camera_m, sun_m, beta;
        bool moves; ///< `beta` is not 0

        /// See BodyState::to_camera().
        [[nodiscard]] Vec3 to_camera(Vec3 from_camera_m) const {
            return transposed(from_camera) * (moves ? untilted(from_camera_m, beta) : from_camera_m);
        }
    };
    Time mid{};
    Mat3 camera_from_inertial{};
    Vec3 beta{}; ///< see RowState
    std::vector<Body> bodies;

    void set(Time at, const RowState& row);
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

/// Memory that the images of a frame's windows share; one takes its part after the other.
class KeptMemory {
public:
    /// For `images` images of `rows` rows of `width` pixels in all.
    KeptMemory(std::size_t width, std::size_t rows, std::size_t images, std::size_t channels,
               std::size_t bodies);
    /// All of it is free again.
    void clear() { floats_taken_ = rows_taken_ = views_taken_ = 0; }

private:
    friend class KeptImage;
    std::vector<float> light_;
    std::vector<LitColumns> lit_;
    std::vector<std::uint8_t> kept_;
    std::vector<KeptView> views_;
    std::size_t floats_taken_ = 0, rows_taken_ = 0, views_taken_ = 0;
};

/// Light of a window without stars and sub-pixel bodies, in the channels and the unit of the tracer.
/// Different threads may keep different rows. Real-time safe but for more bodies than ever before.
class KeptImage {
public:
    /// Rows from one view to the next, where rows have different times.
    static constexpr std::int32_t view_rows = 16, line_view_rows = 4;

    /// Takes the memory for a window, in at most so many channels. False if that is too little, or the window
    /// has too few lines of a push-broom sensor to tell how they follow each other.
    [[nodiscard]] bool place(const KeptWindow& window, std::size_t channel_capacity, KeptMemory& memory);
    /// Forgets all rows: those of a scene with so many bodies follow. `one_time`: all of them have the same
    /// middle of the exposure.
    void begin(std::size_t channels, std::size_t bodies, bool one_time);
    [[nodiscard]] const Region& area() const { return window_.area; }
    [[nodiscard]] const KeptWindow& window() const { return window_; }
    [[nodiscard]] std::size_t channels() const { return channels_; }

    /// Whether the view at the middle of the exposure of row `y` of the area is wanted.
    [[nodiscard]] bool wants_view(std::int32_t y) const {
        return one_time_ ? y == area().y : (y - area().y) % view_step_ == 0;
    }
    void set_view(std::int32_t y, Time mid, const RowState& middle) {
        views_[static_cast<std::size_t>((y - area().y) / view_step_)].set(mid, middle);
    }
    /// Channels x width of the area.
    void keep_row(std::int32_t y, std::span<const double> light);
    /// Whether all rows are kept.
    [[nodiscard]] bool complete() const;

    /// Plane of channel `c`: rows of area().width.
    [[nodiscard]] const float* plane(std::size_t c) const {
        return light_.data() +
               c * static_cast<std::size_t>(area().width) * static_cast<std::size_t>(area().height);
    }
    /// Lit columns of each row, in all channels.
    [[nodiscard]] std::span<const LitColumns> lit() const { return lit_; }

    /// The views about a row, and the share of the second one: beyond the ends, more than 1 or less than 0.
    struct Between {
        const KeptView *first, *second;
        double share;
    };
    [[nodiscard]] Between views_about(double y) const;
    /// Rows from one view to the next.
    [[nodiscard]] std::int32_t view_step() const { return view_step_; }
    /// Line whose exposure has its middle at `mid`, by the times of the lines about `y`.
    [[nodiscard]] double line_at(Time mid, double y) const;

private:
    KeptWindow window_{};
    std::span<float> light_;
    std::span<LitColumns> lit_;
    std::span<std::uint8_t> kept_;
    std::span<KeptView> views_;
    std::size_t channels_ = 0;
    std::int32_t view_step_ = view_rows;
    bool one_time_ = true;
};

} // namespace obscura::renderer
