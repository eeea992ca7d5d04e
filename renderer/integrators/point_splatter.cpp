// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/point_splatter.hpp"

#include "renderer/packets/frames.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace obscura::renderer {

PointSplatter::PointSplatter(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                             const Projection& lens, const GaussianPsf& gaussian_psf, const Psf* psf,
                             std::uint64_t seed)
    : scene_(scene),
      bodies_(bodies),
      lens_(lens),
      gaussian_psf_(gaussian_psf),
      psf_(psf),
      stars_(scene.stars, scene.bands),
      seed_(seed) {}

void PointSplatter::find_stars(std::span<const RowTime> rows, std::vector<std::uint32_t>& found) const {
    found.clear();
    if (stars_.size() == 0 || rows.empty()) return;
    // Take the field at the middle row, grown by the largest turn of the camera within the rows.
    const auto attitude = [&](Time t) { return camera_pose(scene_, bodies_, to_seconds(t.ns)).orientation; };
    const Quat middle = attitude(rows[rows.size() / 2].mid());
    double turn_rad = 0;
    double aberration_rad = 0;
    const RowTime* before = nullptr;
    for (const RowTime& t : rows) {
        if (before != nullptr && *before == t) continue; // a global shutter has one time for all rows
        before = &t;
        for (const Time edge : {t.reset, t.mid(), t.read}) {
            const double cosine = std::min(1.0, std::abs(dot(middle, attitude(edge))));
            turn_rad = std::max(turn_rad, 2 * std::acos(cosine));
        }
        if (scene_.aberration)
            aberration_rad =
                std::max(aberration_rad, 2 * length(camera_beta(scene_, bodies_, to_seconds(t.mid().ns))));
    }
    stars_.inside(rotate(middle, {0, 0, 1}),
                  lens_.field_angle_rad(reach_px() + 1) + turn_rad + aberration_rad + 1e-9, found);
}

void PointSplatter::splat_point(const SplatTarget& target, ImagePoint at, std::span<const double> amount,
                                SplatParts parts, std::vector<double>& light) const {
    const auto width = static_cast<std::size_t>(target.window.width);
    const auto over = [&](double half, const auto& share) {
        const auto from = std::max(target.window.x, static_cast<std::int32_t>(std::floor(at.x - half)));
        const auto to = std::min(target.window.x + target.window.width - 1,
                                 static_cast<std::int32_t>(std::ceil(at.x + half)));
        for (std::int32_t column = from; column <= to; ++column)
            for (std::size_t c = 0; c < amount.size(); ++c)
                light[c * width + static_cast<std::size_t>(column - target.window.x)] +=
                    amount[c] * share(column, c);
    };
    const double dy = target.y - at.y;
    if (psf_ == nullptr) {
        const double row_share = gaussian_psf_.weight(at.y, target.y);
        if (row_share == 0) return;
        over(gaussian_psf_.splat_reach_px(), [&](std::int32_t column, std::size_t) {
            return row_share * gaussian_psf_.weight(at.x, column);
        });
        return;
    }
    if (parts == SplatParts::all && std::abs(dy) < psf_->reach_px())
        over(psf_->reach_px(),
             [&](std::int32_t column, std::size_t c) { return psf_->weight(at, column, target.y, c); });
    const double rest2 = psf_->wings_px() * psf_->wings_px() - dy * dy;
    if (rest2 > 0)
        over(std::sqrt(rest2), [&](std::int32_t column, std::size_t c) {
            const double dx = column - at.x;
            return psf_->wing(c, dx * dx + dy * dy);
        });
}

void PointSplatter::splat(const SplatTarget& target, std::span<const std::uint32_t> in_view,
                          Tracer& tracer) const {
    for (std::size_t b = 0; b < target.row.bodies.size(); ++b)
        splat_body(target, static_cast<std::int32_t>(b), tracer);
    splat_stars(target, in_view, tracer);
}

void PointSplatter::splat_body(const SplatTarget& target, std::int32_t index, Tracer& tracer) const {
    const BodyState& body = target.row.bodies[static_cast<std::size_t>(index)];
    const bool has_wings = psf_ != nullptr && psf_->wings_px() > 0;
    if (!body.targeted && !body.thin_crescent && !has_wings) return;
    if (body.cos_cone < 0) return; // the camera is inside
    // The dark part shines by itself or by what is not sunlight, or has normals of its own.
    const bool dark_shines = !body.disc.exact() || !tracer.sunlight_only() ||
                             (body.built->textures != nullptr && body.built->textures->turns_normals());
    const double sine = body.cone_sine;
    std::uint32_t lit_samples = samples_per_target;
    std::uint32_t dark_samples = dark_shines ? samples_per_target / 2 : 0;
    // Where the crescent is no wider than some discs of the Sun, their penumbra is most of it.
    if (body.disc.exact() && body.disc.lit_share() < 0.004) lit_samples *= 4;
    if (body.targeted || (body.thin_crescent && !has_wings)) {
        const auto centre = target.lens.project(body.direction);
        if (!centre) return;
        const double reach = reach_px() + 2 * std::max(targeted_radius_px, body.radius_px);
        if (std::abs(centre->y - target.y) > reach || centre->x < target.window.x - reach ||
            centre->x > target.window.x + target.window.width - 1 + reach)
            return;
        if (body.thin_crescent) {
            const double area_px = body.disc.lit_share() * std::numbers::pi * body.radius_px * body.radius_px;
            while (lit_samples < 4 * samples_per_target && lit_samples < samples_per_crescent_px * area_px)
                lit_samples *= 2;
            dark_samples = 0;
        } else if (!body.disc.exact()) {
            // Where the light falls on such a shape is not known: more points where it is little.
            while (lit_samples < 8 * samples_per_target &&
                   lit_samples * body.disc.lit_share() < samples_per_target / 4.0)
                lit_samples *= 2;
        }
    } else {
        const double away = std::acos(std::clamp(body.direction.z, -1.0, 1.0));
        if (away > std::asin(sine) + target.lens.field_angle_rad(reach_px() + 1)) return;
        // Space the points more closely than the wings, which begin at half the core, could resolve.
        const double spacing_rad = psf_->reach_px() / 4 * target.lens.local_pixel_angle_rad(body.direction);
        const double wanted = body.solid_angle_sr / (spacing_rad * spacing_rad);
        std::uint32_t samples = 256;
        while (samples < 4096 && samples < wanted)
            samples *= 2;
        lit_samples = samples;
        dark_samples = dark_shines ? samples : 0;
        if (body.thin_crescent) lit_samples = std::max(lit_samples, 4 * samples_per_target);
    }

    // Find occluders: bodies whose bounding cone meets this one's.
    target.candidates.clear();
    for (std::size_t b = 0; b < target.row.bodies.size(); ++b) {
        const BodyState& other = target.row.bodies[b];
        const double reach_cos = body.cos_cone * other.cos_cone - sine * other.cone_sine;
        if (static_cast<std::int32_t>(b) == index || other.cos_cone < 0 ||
            dot(other.direction, body.direction) >= reach_cos)
            target.candidates.push_back(static_cast<std::int32_t>(b));
    }
    const bool lit_whole = body.targeted || body.thin_crescent;
    splat_disc(target, index, LitDisc::Part::lit, lit_whole ? SplatParts::all : SplatParts::wings,
               lit_samples, tracer);
    splat_disc(target, index, LitDisc::Part::dark, body.targeted ? SplatParts::all : SplatParts::wings,
               dark_samples, tracer);
}

void PointSplatter::splat_disc(const SplatTarget& target, std::int32_t index, LitDisc::Part part,
                               SplatParts parts, std::uint32_t samples, Tracer& tracer) const {
    if (samples == 0) return;
    const BodyState& body = target.row.bodies[static_cast<std::size_t>(index)];
    // Share the samples among the instants; below 64 too much of the body is missed.
    if (target.instants > 1) samples = std::bit_floor(std::max(64u, samples / target.instants));
    const SeedWords seeds = seed_words(seed_, target.frame_id, SamplePurpose::body, index, 0);
    const std::uint32_t seed = seeds[part == LitDisc::Part::lit ? 0 : 2];
    tracer.set_ray_width(std::sqrt(body.solid_angle_sr / samples / target.instants));
    const Mat3 to_camera = transposed(body.from_camera);

    CameraRays rays;
    ImagePoint at[packet_size];
    double weight[packet_size];
    int filled = 0;
    set_all(rays.direction, body.direction);
    for (int i = 0; i < packet_size; ++i) {
        rays.index.v[i] = 0;
        rays.light_seed.v[i] = seed;
    }
    const auto trace = [&] {
        // Trace the rays and keep what hits the body.
        Lanes active;
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = i < filled ? -1 : 0;
        filled = 0;
        tracer.intersect(rays.direction, active, target.candidates, rays.hits);
        tracer.count_samples(active);
        for (std::int32_t& hit : rays.hits.body)
            hit = hit == index ? hit : -1;
        tracer.radiance({&rays, 1});
        // Splat each hit through the PSF.
        for (int i = 0; i < packet_size; ++i) {
            if (rays.hits.body[i] < 0) continue;
            double amount[max_channels];
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                amount[c] = weight[i] * rays.radiance.v[c].v[i];
            splat_point(target, at[i], {amount, tracer.channels()}, parts, target.light);
        }
    };
    Words index_of;
    for (std::uint32_t first = target.instant * samples; first < (target.instant + 1) * samples;
         first += packet_size) {
        for (std::uint32_t i = 0; i < packet_size; ++i)
            index_of.v[i] = first + i;
        Doubles u;
        Doubles v;
        // Together with the points of the Sun's disc, the first pair of the samples' numbers: in a thin
        // crescent the light depends on both.
        sobol_second_pair(index_of, rays.light_seed, u, v);
        for (int i = 0; i < packet_size; ++i) {
            // Sample the part's directions; those that light this row are traced.
            Vec3 direction;
            const double solid_angle_sr = body.disc.sample(part, u.v[i], v.v[i], direction);
            if (!(solid_angle_sr > 0)) continue;
            direction = to_camera * direction;
            const auto point = target.lens.project(direction);
            if (!point || std::abs(point->y - target.y) > reach_px()) continue;
            rays.direction.set(filled, direction);
            rays.index.v[filled] = index_of.v[i];
            at[filled] = *point;
            weight[filled] = solid_angle_sr / samples / target.instants * target.lens.transmission(direction);
            if (++filled == packet_size) trace();
        }
    }
    if (filled > 0) trace();
}

void PointSplatter::splat_stars(const SplatTarget& target, std::span<const std::uint32_t> in_view,
                                Tracer& tracer) const {
    const double reach = reach_px();
    for (const std::uint32_t star : in_view) {
        const Vec3 direction = target.row.camera_from_inertial * stars_.direction(star);
        const auto at = target.lens.project(direction);
        if (!at || std::abs(at->y - target.y) > reach || at->x < target.window.x - reach ||
            at->x > target.window.x + target.window.width - 1 + reach)
            continue;
        // Test occlusion by bodies whose bounding cone holds the star.
        target.candidates.clear();
        for (std::size_t b = 0; b < target.row.bodies.size(); ++b)
            if (dot(direction, target.row.bodies[b].direction) >= target.row.bodies[b].cos_cone - 1e-12)
                target.candidates.push_back(static_cast<std::int32_t>(b));
        if (!target.candidates.empty()) {
            Vec3s directions;
            Lanes active{};
            for (int i = 0; i < packet_size; ++i)
                directions.set(i, direction);
            active.on[0] = -1;
            HitPacket hits;
            tracer.intersect(directions, active, target.candidates, hits);
            if (hits.body[0] >= 0) continue;
        }
        const double through = target.lens.transmission(direction) / target.instants;
        double amount[max_channels];
        for (std::size_t b = 0; b < scene_.bands.size(); ++b)
            amount[b] = through * stars_.irradiance(star, b);
        splat_point(target, *at, {amount, scene_.bands.size()}, SplatParts::all, target.starlight);
    }
}

} // namespace obscura::renderer
