// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/point_splatter.hpp"

#include "renderer/integrators/disc_points.hpp"
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
        const double row_share = gaussian_psf_.y.weight(at.y, target.y);
        if (row_share == 0) return;
        over(gaussian_psf_.x.splat_reach_px(), [&](std::int32_t column, std::size_t) {
            return row_share * gaussian_psf_.x.weight(at.x, column);
        });
        return;
    }
    if (std::abs(dy) < psf_->reach_px())
        over(psf_->reach_px(),
             [&](std::int32_t column, std::size_t c) { return psf_->weight(at, column, target.y, c); });
    if (parts == SplatParts::core) return;
    const double rest2 = psf_->wings_px() * psf_->wings_px() - psf_->squared_distance(0, dy);
    if (!(rest2 > 0)) return;
    const PsfZones zones = psf_->zones_at(at.x, at.y);
    over(std::sqrt(rest2), [&](std::int32_t column, std::size_t c) {
        return psf_->wing(zones, c, psf_->squared_distance(column - at.x, dy));
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
    if (!body.targeted && !body.thin_crescent) return;
    if (body.cos_cone < 0) return; // the camera is inside
    const auto centre = target.lens.project(body.direction);
    if (!centre) return;
    const double reach = reach_px() + 2 * std::max(targeted_radius_px, body.radius_px);
    if (std::abs(centre->y - target.y) > reach || centre->x < target.window.x - reach ||
        centre->x > target.window.x + target.window.width - 1 + reach)
        return;
    std::uint32_t lit_samples = samples_per_target;
    std::uint32_t dark_samples = dark_part_shines(body, tracer) ? samples_per_target / 2 : 0;
    // Where the crescent is no wider than some discs of the Sun, their penumbra is most of it.
    if (body.disc.exact() && body.disc.lit_share() < 0.004) lit_samples *= 4;
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
    find_occluders(target.row, index, target.candidates);
    splat_disc(target, index, LitDisc::Part::lit, lit_samples, tracer);
    splat_disc(target, index, LitDisc::Part::dark, dark_samples, tracer);
}

void PointSplatter::splat_disc(const SplatTarget& target, std::int32_t index, LitDisc::Part part,
                               std::uint32_t samples, Tracer& tracer) const {
    if (samples == 0) return;
    // Share the samples among the instants; below 64 too much of the body is missed.
    if (target.instants > 1) samples = std::bit_floor(std::max(64u, samples / target.instants));
    const SeedWords seeds = seed_words(seed_, target.frame_id, SamplePurpose::body, index, 0);
    const DiscPoints points{target.row,
                            index,
                            part,
                            target.instant * samples,
                            samples,
                            samples * target.instants,
                            seeds[part == LitDisc::Part::lit ? 0 : 2]};
    // Points that light this row are traced, and splatted through the PSF. The wings of crescents are in the
    // wing map.
    const SplatParts parts =
        target.row.bodies[static_cast<std::size_t>(index)].targeted ? SplatParts::all : SplatParts::core;
    trace_disc(
        points, target.lens, target.candidates, tracer,
        [&](ImagePoint at) { return std::abs(at.y - target.y) <= reach_px(); },
        [&](ImagePoint at, std::span<const double> amount) {
            splat_point(target, at, amount, parts, target.light);
        });
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
