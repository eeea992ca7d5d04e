// SPDX-License-Identifier: Apache-2.0
// Chart of what a camera has in its field: stars, bodies, coordinate grid, names.
#pragma once

#include "core/camera/scene_truth.hpp"
#include "ephemeris/stars/star_names.hpp"
#include "renderer/scene/scene.hpp"
#include "tools/pictures/drawing.hpp"

namespace obscura::tools {

/// Contents of a chart.
struct SkyChart {
    const scene::Scene& scene;
    const SceneTruth& truth; ///< of the whole sensor, at one instant
    const ephemeris::StarNames& names;
    std::int32_t curve_points = 0; ///< of each limb and terminator in `truth`
    double time_s = 0;
    double faintest_v = 99;   ///< fainter stars and sky objects are not drawn
    std::int32_t side = 1000; ///< longer side of the field, pixels of the drawing
};

/// Whether an entry is one of the scene's sky objects: what moves or varies, or a galaxy.
[[nodiscard]] inline bool is_sky_object(const TruthEntry& entry) {
    return entry.kind == TruthKind::galaxy || (entry.kind == TruthKind::star && entry.object < 0);
}

/// Right ascension and declination of the direction of the camera's boresight, rad.
[[nodiscard]] std::pair<double, double> boresight_of(const Pose& camera);

/// Draws the chart: discs by magnitude and colour, outlines with the lit part of the limb bright, terminators
/// dashed, names of the brightest.
[[nodiscard]] Drawing draw_sky(const SkyChart& chart);

} // namespace obscura::tools
