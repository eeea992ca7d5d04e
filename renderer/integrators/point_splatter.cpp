// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/point_splatter.hpp"

#include "renderer/integrators/body_points.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

namespace obscura::renderer {
namespace {

/// Samples of the work on a body that is done at a time.
constexpr std::uint32_t samples_per_job = 2048;
/// For the wings, which are smooth over several pixels, points in squares of this size are merged.
constexpr double merged_px = 0.25;
/// Pixels of a tile for each of its points from which on there is none.
constexpr std::size_t min_pixels_per_point = 8;

/// Samples of the lit part of a disc.
std::uint32_t disc_samples(const BodyState& body) {
    std::uint32_t samples = samples_per_target;
    // Where the crescent is no wider than some discs of the Sun, their penumbra is most of it.
    if (body.disc.exact() && body.disc.lit_share() < 0.004) samples *= 4;
    if (body.thin_crescent) {
        const double area_px = body.disc.lit_share() * std::numbers::pi * body.radius_px * body.radius_px;
        while (samples < 4 * samples_per_target && samples < samples_per_crescent_px * area_px)
            samples *= 2;
    } else if (!body.disc.exact()) {
        // Where the light falls on such a shape is not known: more points where it is little.
        while (samples < 8 * samples_per_target && samples * body.disc.lit_share() < samples_per_target / 4.0)
            samples *= 2;
    }
    return samples;
}

/// Samples of the lit facets: more where many of them are in shadow.
std::uint32_t facet_samples(const BodyState& body) {
    const double lit_share = body.disc.lit_share();
    const std::uint32_t samples = lit_share > 0.6     ? min_facet_samples
                                  : lit_share > 0.2   ? 2 * min_facet_samples
                                  : lit_share > 0.012 ? 4 * min_facet_samples
                                  : lit_share > 0.004 ? 8 * min_facet_samples
                                                      : 16 * min_facet_samples;
    // No fewer than pixels would take of a crescent.
    const double lit_px = lit_share * std::numbers::pi * body.radius_px * body.radius_px;
    const double pixel_samples = 4.0 * body.samples * lit_px;
    return std::max(samples, std::bit_ceil(static_cast<std::uint32_t>(std::min(pixel_samples, 0x1p24))));
}

/// Fills `merged` with the points, those that are close together as one; keeps light and centre.
void merge_points(const LightPoints& points, LightPoints& merged) {
    struct Place {
        std::int64_t y, x;
        std::size_t index;
    };
    std::vector<Place> places;
    places.reserve(points.at.size());
    for (std::size_t i = 0; i < points.at.size(); ++i)
        places.push_back({std::llround(std::floor(points.at[i].y / merged_px)),
                          std::llround(std::floor(points.at[i].x / merged_px)), i});
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return std::tie(a.y, a.x, a.index) < std::tie(b.y, b.x, b.index);
    });
    const std::size_t channels = points.amount.size() / points.at.size();
    merged.at.clear();
    merged.amount.clear();
    for (std::size_t first = 0; first < places.size();) {
        std::size_t end = first;
        double x = 0;
        double y = 0;
        double sum = 0;
        merged.amount.resize(merged.amount.size() + channels);
        double* const amount = merged.amount.data() + merged.amount.size() - channels;
        for (; end < places.size() && places[end].x == places[first].x && places[end].y == places[first].y;
             ++end) {
            const std::size_t i = places[end].index;
            double light = 0;
            for (std::size_t c = 0; c < channels; ++c) {
                amount[c] += points.amount[i * channels + c];
                light += points.amount[i * channels + c];
            }
            x += light * points.at[i].x;
            y += light * points.at[i].y;
            sum += light;
        }
        merged.at.push_back({x / sum, y / sum});
        first = end;
    }
}

} // namespace

SplatTable::SplatTable(const GaussianAxis& axis)
    : before_(static_cast<std::int32_t>(std::ceil(axis.splat_reach_px()))) {
    columns_ = 2 * before_ + 2;
    for (int k = 0; k <= positions; ++k)
        for (std::int32_t column = 0; column < columns_; ++column) {
            const double at = static_cast<double>(k) / positions;
            table_.push_back(axis.weight(at, column - before_));
        }
}

std::int32_t SplatTable::weights(double x, std::vector<double>& weights) const {
    const double pixel = std::floor(x);
    const double position = (x - pixel) * positions;
    const int k = std::min(static_cast<int>(position), positions - 1);
    const double next = position - k;
    const double* const a = table_.data() + static_cast<std::size_t>(k * columns_);
    weights.resize(static_cast<std::size_t>(columns_));
    for (std::size_t i = 0; i < weights.size(); ++i)
        weights[i] = a[i] + (a[i + weights.size()] - a[i]) * next;
    return static_cast<std::int32_t>(pixel) - before_;
}

PointSplatter::PointSplatter(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                             const Projection& lens, const GaussianPsf& gaussian_psf, const Psf* psf,
                             std::uint64_t seed)
    : scene_(scene),
      bodies_(bodies),
      lens_(lens),
      gaussian_psf_(gaussian_psf),
      psf_(psf),
      across_(gaussian_psf.x),
      down_(gaussian_psf.y),
      stars_(scene),
      sky_(scene),
      seed_(seed) {}

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
        if (parts == SplatParts::wings) return;
        double row_share = 0;
        gaussian_psf_.y.weights(at.y, target.y, {&row_share, 1});
        if (!(row_share > 0)) return;
        // The standard deviation is 20 px at most, in pitches of the columns, and reaches 6.5 times as far.
        std::array<double, 272> shares; // NOLINT(cppcoreguidelines-pro-type-member-init): filled below
        const double half = gaussian_psf_.x.splat_reach_px();
        const auto from = std::max(target.window.x, static_cast<std::int32_t>(std::floor(at.x - half)));
        const auto end = std::min(target.window.x + target.window.width,
                                  static_cast<std::int32_t>(std::ceil(at.x + half)) + 1);
        if (end <= from) return;
        const auto count = std::min(static_cast<std::size_t>(end - from), shares.size());
        gaussian_psf_.x.weights(at.x, from, {shares.data(), count});
        for (std::size_t c = 0; c < amount.size(); ++c) {
            double* const row = light.data() + c * width + static_cast<std::size_t>(from - target.window.x);
            const double share = amount[c] * row_share;
            for (std::size_t i = 0; i < count; ++i)
                row[i] += share * shares[i];
        }
        return;
    }
    if (parts != SplatParts::wings && std::abs(dy) < psf_->reach_px())
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

void PointSplatter::plan_points(const PointView& view, std::uint32_t instant, std::uint32_t instants,
                                const Tracer& tracer, std::vector<PointJob>& jobs) const {
    for (std::size_t b = 0; b < view.row.bodies.size(); ++b) {
        const BodyState& body = view.row.bodies[b];
        if (!body.targeted && !body.thin_crescent) continue;
        if (body.cos_cone < 0) continue; // the camera is inside
        const auto centre = view.lens.project(body.direction);
        if (!centre) continue;
        const double reach = reach_px() + 2 * std::max(targeted_radius_px, body.radius_px);
        if (centre->y + reach < view.first_y || centre->y - reach > view.first_y + view.rows - 1 ||
            centre->x + reach < view.window.x || centre->x - reach > view.window.x + view.window.width - 1)
            continue;
        PointJob job;
        job.body = static_cast<std::int32_t>(b);
        job.instant = instant;
        job.instants = instants;
        const bool dark_shines = dark_part_shines(body, tracer);
        if (const FacetSet* facets = body.disc.exact() ? nullptr : body.shape->facets())
            job.facets = facets->lit(body.camera_m, body.sun_m, scene_.sun.radius_m, dark_shines);
        const SeedWords seeds = seed_words(seed_, view.frame_id, SamplePurpose::body, job.body, 0);
        const auto add = [&](std::uint32_t samples, std::uint32_t seed) {
            // Share the samples among the instants; below 64 too much of the body is missed.
            job.of = std::bit_floor(std::max(64u, samples / instants));
            job.count = std::min(job.of, samples_per_job);
            job.seed = seed;
            for (job.first = 0; job.first < job.of; job.first += job.count)
                jobs.push_back(job);
        };
        if (job.facets) {
            job.of_facets = true;
            const std::uint32_t samples = facet_samples(body);
            if (view.alone)
                add(samples / 4,
                    seed_words(seed_, view.frame_id, SamplePurpose::body, job.body, view.first_y + 1)[1]);
            else
                add(samples, seeds[1]);
            job.of_facets = false;
        }
        for (const LitDisc::Part part : {LitDisc::Part::lit, LitDisc::Part::dark}) {
            // Pixels sample the rest of a crescent.
            if (body.thin_crescent && (part == LitDisc::Part::dark || job.facets)) continue;
            if (!shines(body, part, job.facets.get(), tracer)) continue;
            const bool lit = part == LitDisc::Part::lit;
            job.part = part;
            std::uint32_t samples = lit && !job.facets ? disc_samples(body) : samples_per_target / 2;
            // Spots of a few degrees hold all the light of some emission maps.
            if (body.built->textures != nullptr && body.built->textures->varies_emission())
                samples = std::max(samples, 8 * samples_per_target);
            add(samples, seeds[lit ? 0 : 2]);
        }
    }
}

void PointSplatter::trace_points(const PointView& view, const PointJob& job, Tracer& tracer,
                                 BodyPoints& light) const {
    LightPoints& points = light.points;
    points.at.clear();
    points.amount.clear();
    light.tile.clear();
    light.wings.at.clear();
    find_occluders(view.row, job.body, view.candidates);
    const BodySamples samples{view.row, job.body, job.first,   job.count,
                              job.of,   job.seed, job.instant, job.instants};
    // Shared points do not depend on the rows that they are wanted for.
    const double reach = reach_px();
    const auto wanted = [&](ImagePoint at) {
        return !view.alone || (at.y + reach >= view.first_y && at.y - reach <= view.first_y + view.rows - 1);
    };
    const auto add = [&](ImagePoint at, std::span<const double> amount) {
        if (std::all_of(amount.begin(), amount.end(), [](double a) { return a == 0; })) return;
        points.at.push_back(at);
        points.amount.insert(points.amount.end(), amount.begin(), amount.end());
    };
    if (job.of_facets)
        trace_facets(samples, *job.facets, view.lens, view.candidates, tracer, wanted, add);
    else
        trace_disc(samples, job.part, job.facets.get(), view.lens, view.candidates, tracer, wanted, add);
    if (points.at.empty()) return;
    // The wings of crescents are in the wing map.
    if (psf_ != nullptr && psf_->wings_px() > 0 &&
        view.row.bodies[static_cast<std::size_t>(job.body)].targeted)
        merge_points(points, light.wings);
    if (!view.alone) fill_tile(light);
}

void PointSplatter::fill_tile(BodyPoints& light) const {
    LightPoints& points = light.points;
    const double reach =
        psf_ != nullptr ? psf_->reach_px() : std::max(across_.columns(), down_.columns()) / 2;
    ImagePoint least = points.at.front();
    ImagePoint most = least;
    for (const ImagePoint p : points.at) {
        least = {std::min(least.x, p.x), std::min(least.y, p.y)};
        most = {std::max(most.x, p.x), std::max(most.y, p.y)};
    }
    const auto before = [&](double a) { return static_cast<std::int32_t>(std::floor(a - reach)); };
    const auto after = [&](double a) { return static_cast<std::int32_t>(std::ceil(a + reach)); };
    light.tile_x = before(least.x);
    light.tile_y = before(least.y);
    light.tile_width = after(most.x) - light.tile_x + 1;
    light.tile_rows = after(most.y) - light.tile_y + 1;
    const auto width = static_cast<std::size_t>(light.tile_width);
    const std::size_t area = width * static_cast<std::size_t>(light.tile_rows);
    if (points.at.size() * min_pixels_per_point < area) return;
    const std::size_t channels = points.amount.size() / points.at.size();
    light.tile.assign(channels * area, 0);
    const auto pixel = [&](std::size_t c, std::int32_t x, std::int32_t y) {
        return light.tile.data() + c * area + static_cast<std::size_t>(y - light.tile_y) * width +
               static_cast<std::size_t>(x - light.tile_x);
    };
    std::vector<double> across;
    std::vector<double> down;
    for (std::size_t i = 0; i < points.at.size(); ++i) {
        const ImagePoint at = points.at[i];
        const double* const amount = points.amount.data() + i * channels;
        if (psf_ != nullptr) {
            for (std::size_t c = 0; c < channels; ++c)
                for (std::int32_t y = before(at.y); y <= after(at.y); ++y)
                    for (std::int32_t x = before(at.x); x <= after(at.x); ++x)
                        *pixel(c, x, y) += amount[c] * psf_->weight(at, x, y, c);
            continue;
        }
        const std::int32_t left = across_.weights(at.x, across);
        const std::int32_t top = down_.weights(at.y, down);
        for (std::size_t c = 0; c < channels; ++c)
            for (std::size_t k = 0; k < down.size(); ++k) {
                double* const row = pixel(c, left, top + static_cast<std::int32_t>(k));
                const double share = amount[c] * down[k];
                for (std::size_t x = 0; x < across.size(); ++x)
                    row[x] += share * across[x];
            }
    }
    points.at.clear();
    points.amount.clear();
}

void PointSplatter::splat_body(const SplatTarget& target, const BodyPoints& light) const {
    const auto splat = [&](const LightPoints& points, double reach, SplatParts parts) {
        if (points.at.empty()) return;
        const std::size_t channels = points.amount.size() / points.at.size();
        for (std::size_t i = 0; i < points.at.size(); ++i)
            if (std::abs(points.at[i].y - target.y) <= reach)
                splat_point(target, points.at[i], std::span(points.amount).subspan(i * channels, channels),
                            parts, target.light);
    };
    splat(light.points, core_reach_px(), SplatParts::core);
    splat(light.wings, reach_px(), SplatParts::wings);
    if (light.tile.empty() || target.y < light.tile_y || target.y >= light.tile_y + light.tile_rows) return;
    const auto tile_width = static_cast<std::size_t>(light.tile_width);
    const std::size_t area = tile_width * static_cast<std::size_t>(light.tile_rows);
    const auto width = static_cast<std::size_t>(target.window.width);
    const std::int32_t from = std::max(target.window.x, light.tile_x);
    const std::int32_t to = std::min(target.window.x + target.window.width, light.tile_x + light.tile_width);
    const double* const row =
        light.tile.data() + static_cast<std::size_t>(target.y - light.tile_y) * tile_width;
    for (std::size_t c = 0; c < light.tile.size() / area; ++c)
        for (std::int32_t x = from; x < to; ++x)
            target.light[c * width + static_cast<std::size_t>(x - target.window.x)] +=
                row[c * area + static_cast<std::size_t>(x - light.tile_x)];
}

void PointSplatter::splat_source(const SplatTarget& target, Vec3 direction, double distance_m,
                                 std::span<const double> irradiance_w_m2, Tracer& tracer) const {
    const double reach = reach_px();
    const auto at = target.lens.project(direction);
    if (!at || std::abs(at->y - target.y) > reach || at->x < target.window.x - reach ||
        at->x > target.window.x + target.window.width - 1 + reach)
        return;
    // Test occlusion by bodies whose bounding cone holds the source.
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
        if (hits.body[0] >= 0 && hits.t[0] < distance_m) return;
    }
    const double through = target.lens.transmission(direction) / target.instants;
    double amount[max_channels];
    for (std::size_t b = 0; b < irradiance_w_m2.size(); ++b)
        amount[b] = through * irradiance_w_m2[b];
    splat_point(target, *at, {amount, irradiance_w_m2.size()}, SplatParts::all, target.starlight);
}

void PointSplatter::splat_stars(const SplatTarget& target, const FieldStars& stars,
                                std::span<const std::uint32_t> in_row, Tracer& tracer) const {
    const std::size_t bands = scene_.bands.size();
    for (const std::uint32_t star : in_row)
        splat_source(target, target.row.camera_from_inertial * stars.places[star].from(target.observer),
                     no_hit, std::span(stars.irradiance_w_m2).subspan(star * bands, bands), tracer);
}

void PointSplatter::splat_sky(const SplatTarget& target, Tracer& tracer) const {
    double irradiance_w_m2[max_channels];
    for (std::size_t i = 0; i < sky_.size(); ++i) {
        const auto source = sky_.at(i, bodies_, target.row.camera.position_m, target.time_s);
        if (!source) continue;
        const std::span bands(irradiance_w_m2, scene_.bands.size());
        sky_.irradiance(i, *source, bands);
        splat_source(target, target.row.camera_from_inertial * source->direction, source->distance_m, bands,
                     tracer);
    }
}

} // namespace obscura::renderer
