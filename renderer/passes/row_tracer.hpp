// SPDX-License-Identifier: Apache-2.0
// Choice of a row's tracer: direct sunlight only, or paths.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "renderer/integrators/path_tracer.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/scratch.hpp"

#include <cmath>

namespace obscura::renderer {

/// Calls `use(tracer)` with the tracer for the scene.
template<typename Use>
void with_tracer(const BuiltScene& built, const Instants& instants, Scratch& s, const Use& use,
                 QualityLevel level = QualityLevel::full) {
    const double ray_width_rad = built.pixel_width_rad() / std::sqrt(built.settings.samples_per_pixel);
    if (built.plain) {
        Tracer tracer(instants, built.scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    } else {
        PathTracer tracer(instants,
                          level == QualityLevel::bounces ? built.lighting_few_bounces : built.lighting,
                          built.scene.sun, s.counts);
        tracer.set_ray_width(ray_width_rad);
        use(tracer);
    }
}

} // namespace obscura::renderer
