// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/body_light.hpp"

#include "renderer/integrators/body_points.hpp"

namespace obscura::renderer {
namespace {

/// Seeds of the sequences: of the lit and the dark part of a disc, and of a point.
constexpr std::uint32_t lit_seed = 0x6c1a3d97, dark_seed = 0x2f85b1e3, point_seed = 0x91d7c20b;

} // namespace

void trace_irradiance(const RowState& row, std::int32_t body, const Projection& lens, const Region& sensor,
                      Tracer& tracer, std::vector<std::int32_t>& candidates, BandLight& light) {
    light.fill(0);
    const BodyState& state = row.bodies[static_cast<std::size_t>(body)];
    if (state.cos_cone < 0) return;
    find_occluders(row, body, candidates);
    const auto on_sensor = [&](ImagePoint at) {
        return at.x >= sensor.x - 0.5 && at.x < sensor.x + sensor.width - 0.5 && at.y >= sensor.y - 0.5 &&
               at.y < sensor.y + sensor.height - 0.5;
    };
    const auto add = [&](ImagePoint /*at*/, std::span<const double> amount) {
        for (std::size_t c = 0; c < amount.size(); ++c)
            light[c] += amount[c];
    };
    for (const LitDisc::Part part : {LitDisc::Part::lit, LitDisc::Part::dark}) {
        if (!shines(state, part, nullptr, tracer)) continue;
        const BodySamples samples{row,
                                  body,
                                  0,
                                  body_light_samples,
                                  body_light_samples,
                                  part == LitDisc::Part::lit ? lit_seed : dark_seed};
        trace_disc(samples, part, nullptr, lens, candidates, tracer, on_sensor, add);
    }
}

void trace_radiance(const RowState& row, std::int32_t body, Vec3 direction, double ray_width_rad,
                    Tracer& tracer, std::vector<std::int32_t>& candidates, BandLight& light) {
    light.fill(0);
    find_occluders(row, body, candidates);
    tracer.set_ray_width(ray_width_rad);
    CameraRays rays;
    set_all(rays.direction, direction);
    Lanes active;
    for (int i = 0; i < packet_size; ++i) {
        active.on[i] = -1;
        rays.light_seed.v[i] = point_seed;
        rays.instant.v[i] = 0;
    }
    for (std::uint32_t first = 0; first < point_light_samples; first += packet_size) {
        for (std::uint32_t i = 0; i < packet_size; ++i)
            rays.index.v[i] = first + i;
        tracer.intersect(rays.direction, active, candidates, rays.hits);
        tracer.count_samples(active);
        for (int i = 0; i < packet_size; ++i)
            if (rays.hits.body[i] != body) rays.hits.body[i] = -1;
        tracer.radiance({&rays, 1});
        for (int i = 0; i < packet_size; ++i)
            for (std::size_t c = 0; c < tracer.channels() && rays.hits.body[i] >= 0; ++c)
                light[c] += rays.radiance.v[c].v[i] / point_light_samples;
    }
}

} // namespace obscura::renderer
