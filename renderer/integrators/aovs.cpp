// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/aovs.hpp"

#include "renderer/camera/projection.hpp"
#include "renderer/shapes/stretched_rays.hpp"
#include "renderer/world/instants.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace obscura::renderer {
namespace {

constexpr double degrees = 180 / std::numbers::pi;

double angle_deg(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b)) * degrees;
}

/// Writes the AOVs of one pixel.
class Pixel {
public:
    Pixel(float* out, std::size_t plane) : out_(out), plane_(plane) {}
    void set(Aov aov, double value) {
        out_[static_cast<std::size_t>(aov) * plane_] = static_cast<float>(value);
    }

private:
    float* out_;
    std::size_t plane_;
};

/// Texture coordinates, albedo and material slot of one body at 16 hits.
struct SurfaceLook {
    Doubles u, v, albedo;
    std::size_t slot[packet_size];
};

/// Fills `look` and applies the normal map to `surface`.
void apply_textures(const RowState& row, const BodyState& body, const RayPacket& rays, const HitPacket& hits,
                    std::int32_t index, double ray_width_rad, SurfacePacket& surface, SurfaceLook& look) {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    const SurfaceTextures* const textures = body.built->textures.get();
    UvPacket uv;
    bool has_uv = true;
    if (textures != nullptr)
        textures->texture_coordinates(*body.shape, hits, index, surface, uv);
    else
        has_uv = body.shape->texture_coordinates(hits, index, surface, uv);
    Channels factor;
    ParameterPacket varied;
    if (textures != nullptr) {
        Doubles width_m;
        for (int i = 0; i < packet_size; ++i)
            width_m[i] = hits.body[i] == index ? hits.t[i] * ray_width_rad : 0.0;
        SampleTimes time;
        Instants(row).times({}, time);
        textures->apply(*body.shape, rays, hits, index, width_m, 1, time, surface, factor, varied);
    }
    Doubles albedo;
    for (double& value : albedo.v)
        value = unknown;
    if (body.material != nullptr) {
        ScatterPacket upright;
        Doubles r;
        for (int i = 0; i < packet_size; ++i)
            upright.cos_in[i] = upright.cos_out[i] = upright.cos_phase[i] = 1;
        if (textures != nullptr && textures->varies()) upright.varied = &varied;
        body.material->reflectance(upright, r);
        const double mirror = body.material->mirror_reflectance();
        const double colour = body.built->colour.empty() ? 1 : body.built->colour[0];
        for (int i = 0; i < packet_size; ++i)
            albedo[i] = (mirror >= 0 ? mirror : r[i] * std::numbers::pi) * colour;
    }
    for (int i = 0; i < packet_size; ++i) {
        look.u[i] = has_uv ? uv.u[i] : unknown;
        look.v[i] = has_uv ? uv.v[i] : unknown;
        look.albedo[i] = textures != nullptr ? albedo[i] * factor.v[0][i] : albedo[i];
        look.slot[i] = textures != nullptr && textures->slots() > 1 && hits.body[i] == index
                           ? body.shape->material_slot(hits.primitive[i])
                           : 0;
    }
}

/// Lists the bodies whose bounding cones some of 16 directions of the camera frame meet.
void find_candidates(const RowState& row, const Vec3s& direction, std::vector<std::int32_t>& candidates) {
    candidates.clear();
    for (std::int32_t b = 0; b < static_cast<std::int32_t>(row.bodies.size()); ++b) {
        const BodyState& body = row.bodies[static_cast<std::size_t>(b)];
        for (int i = 0; i < packet_size; ++i)
            if (length_squared(direction.lane(i) - body.direction) <= body.reach_chord2) {
                candidates.push_back(b);
                break;
            }
    }
}

/// Intersects rays through the centres of 16 pixels with those bodies; leaves `rays` in the last one's frame.
void trace_centres(const RowState& row, const Vec3s& direction, const Doubles& solid_angle,
                   std::span<const std::int32_t> candidates, RayPacket& rays, HitPacket& hits) {
    hits.clear();
    for (int i = 0; i < packet_size; ++i) {
        rays.t_max[i] = no_hit;
        rays.active.on[i] = solid_angle[i] > 0 ? -1 : 0;
        rays.level_u[i] = 0.5;
    }
    for (const std::int32_t b : candidates) {
        Instants(row).from_camera(b, {}, direction, rays);
        intersect_stretched(*row.bodies[static_cast<std::size_t>(b)].shape, rays, b, hits);
    }
}

/// No body is in the pixel.
void set_empty(Pixel& pixel) {
    for (std::size_t k = 0; k < aov_count; ++k)
        pixel.set(static_cast<Aov>(k), std::numeric_limits<double>::quiet_NaN());
    pixel.set(Aov::body, 0);
}

/// Sets place and angles of hit `i`; `cos_axis`: cosine of the angle of its ray to the boresight.
void set_geometry(const BodyState& body, const SurfacePacket& surface, int i, double cos_axis, Pixel& pixel) {
    const Vec3 position = surface.position.lane(i);
    const Vec3 normal = surface.normal.lane(i);
    const Vec3 to_camera = body.camera_m - position;
    const Vec3 to_sun = body.sun_m - position;
    const Vec3 inertial_normal = body.to_inertial * normal;
    const double range = length(body.seen.moves() ? untilted(-to_camera, body.beta) : to_camera);
    const double radius = length(position);
    pixel.set(Aov::range_m, range);
    pixel.set(Aov::depth_m, range * cos_axis);
    pixel.set(Aov::normal_x, inertial_normal.x);
    pixel.set(Aov::normal_y, inertial_normal.y);
    pixel.set(Aov::normal_z, inertial_normal.z);
    pixel.set(Aov::longitude_deg, std::atan2(position.y, position.x) * degrees);
    pixel.set(Aov::latitude_deg,
              radius > 0 ? std::asin(std::clamp(position.z / radius, -1.0, 1.0)) * degrees : 0);
    pixel.set(Aov::slope_deg, radius > 0 ? angle_deg(normal, body.shape->up(position)) : 0);
    const bool is_sun = body.material == nullptr;
    pixel.set(Aov::incidence_deg,
              is_sun ? std::numeric_limits<double>::quiet_NaN() : angle_deg(normal, to_sun));
    pixel.set(Aov::emission_deg, angle_deg(normal, to_camera));
    pixel.set(Aov::phase_deg,
              is_sun ? std::numeric_limits<double>::quiet_NaN() : angle_deg(to_sun, to_camera));
}

} // namespace

const char* aov_name(Aov aov) {
    constexpr std::array<const char*, aov_count> names{"body",
                                                       "range_m",
                                                       "depth_m",
                                                       "normal.x",
                                                       "normal.y",
                                                       "normal.z",
                                                       "latitude_deg",
                                                       "longitude_deg",
                                                       "slope_deg",
                                                       "incidence_deg",
                                                       "emission_deg",
                                                       "phase_deg",
                                                       "u",
                                                       "v",
                                                       "albedo",
                                                       "material"};
    return names[static_cast<std::size_t>(aov)];
}

void trace_aovs(const Projection& projection, const RowState& row, std::int32_t x, std::int32_t y,
                std::int32_t width, double ray_width_rad, std::vector<std::int32_t>& candidates, float* out,
                std::size_t plane) {
    // Blocks start at multiples of 16 of the sensor, so that a window is the crop of the whole.
    const std::int32_t first =
        x >= 0 ? x / packet_size * packet_size : -((-x + packet_size - 1) / packet_size) * packet_size;
    for (std::int32_t block = first; block < x + width; block += packet_size) {
        Doubles px;
        Doubles py;
        for (int i = 0; i < packet_size; ++i) {
            px[i] = block + i;
            py[i] = y;
        }
        Vec3s direction;
        Doubles solid_angle;
        projection.rays(px, py, direction, solid_angle);
        find_candidates(row, direction, candidates);
        RayPacket rays;
        HitPacket hits;
        trace_centres(row, direction, solid_angle, candidates, rays, hits);
        SurfacePacket surface;
        SurfaceLook look;
        std::int32_t of_body = -1;
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t column = block + i - x;
            if (column < 0 || column >= width) continue;
            Pixel pixel(out + column, plane);
            const std::int32_t b = hits.body[i];
            if (b < 0) {
                set_empty(pixel);
                continue;
            }
            const BodyState& body = row.bodies[static_cast<std::size_t>(b)];
            if (b != of_body) {
                Instants(row).from_camera(b, {}, direction, rays);
                HitPacket scratch;
                const HitPacket& in_frame = hits_in_frame(rays, hits, scratch);
                body.shape->surface(rays, in_frame, b, surface);
                of_body = b;
                apply_textures(row, body, rays, in_frame, b, ray_width_rad, surface, look);
            }
            pixel.set(Aov::body, b + 1);
            set_geometry(body, surface, i, direction.z[i], pixel);
            pixel.set(Aov::u, look.u[i]);
            pixel.set(Aov::v, look.v[i]);
            pixel.set(Aov::albedo, look.albedo[i]);
            pixel.set(Aov::material, body.built->first_material + look.slot[i]);
        }
    }
}

} // namespace obscura::renderer
