// SPDX-License-Identifier: Apache-2.0
// Overlay of a frame: where its bodies, their limbs and its stars are in the image, for viewers.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/camera/projection.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace obscura::renderer {

struct TruthScene;

/// Frame whose overlay is wanted.
struct OverlayRequest {
    std::span<const FrameWindow> windows; ///< of the composed image
    std::span<const RowTime> rows;        ///< of the composed image, scene time
    bool push_broom = false;              ///< every row is the first row of its window
    std::uint64_t frame_id = 0;
    const GroundTruth& truth; ///< poses of the frame, whatever the scene is at now
    Time mid;                 ///< scene time of those poses
    /// Response of the detector, for each spectral band, as TruthDetector; empty: none.
    std::span<const double> electrons_per_s_per_w_m2{};
    std::uint32_t limb_points = 64; ///< most of each limb in each window
    std::size_t max_stars = 100;    ///< the brightest for the camera
    std::size_t max_bodies = 64;    ///< the first of the scene
};

/// Point of a limb. Points that follow each other are connected unless the later one `begins` a part.
struct LimbPoint {
    ImagePoint at;
    bool lit = false; ///< the centre of the Sun is above the horizon there
    bool begins = false;
};

/// A body in the camera's field.
struct OverlayBody {
    std::string name;
    /// Where the light of its origin lands, also outside of the image. None: behind the camera or far
    /// outside.
    std::optional<ImagePoint> at;
    std::optional<double> radius_px; ///< of its bounding sphere; none: the camera is inside
    double range_m = 0;              ///< from the camera to its origin, at mid-exposure, as is the next
    Vec3 position_m;                 ///< inertial
    struct Motion {
        ImagePoint start, end;
    };
    /// Motion of its origin from the middle of the first row's exposure to that of the last one's, on the
    /// same pixels; none: it is less than half a pixel.
    std::optional<Motion> motion;
    std::vector<LimbPoint> limb; ///< where it is seen on the pixels; empty: it is nowhere, or below a pixel
};

/// A star that is seen.
struct OverlayStar {
    ImagePoint at;
    double magnitude_v = 0;
    std::string name;                                    ///< of a sky object; empty: of a catalogue
    double right_ascension_rad = 0, declination_rad = 0; ///< J2000, of a star of a catalogue
};

/// Points are in the composed image, px, with the centre of pixel (0, 0) at (0, 0): where the light lands, of
/// each row at the middle of its own exposure, with all effects of the lens and the centroid of the PSF, as
/// in the truth table (renderer/truth/scene_truth.hpp).
struct Overlay {
    std::vector<OverlayBody> bodies; ///< in the order of the scene, without the Sun
    std::size_t bodies_of = 0;       ///< in the scene
    std::vector<OverlayStar> stars;  ///< the brightest first
};

/// Limbs of ellipsoids are exact, those of terrains on ellipsoids end within 1e-9 of the radius, both are
/// closest where the field is. Those of other shapes are the outermost surface in directions about the
/// origin's, which leaves out overhangs.
[[nodiscard]] Overlay make_overlay(const TruthScene& scene, const OverlayRequest& request);

} // namespace obscura::renderer
