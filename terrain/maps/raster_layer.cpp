// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/raster_layer.hpp"

#include "terrain/maps/patch_overlap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::terrain {
namespace {

/// Foot on the ellipsoid of the perpendicular through a point near its surface.
struct Foot {
    Vec3 point;
    double height_m = 0; ///< of the point above the foot
    Vec3 normal;
};

Foot foot_of(Vec3 x, Vec3 radii) {
    const Vec3 squares{radii.x * radii.x, radii.y * radii.y, radii.z * radii.z};
    // Newton's method for t in sum (radius x / (radius^2 + t))^2 = 1: the foot is radius^2 x / (radius^2 +
    // t).
    const double scale = std::min({squares.x, squares.y, squares.z});
    double t = 0;
    for (int k = 0; k < 20; ++k) {
        const Vec3 g{x.x / (squares.x + t), x.y / (squares.y + t), x.z / (squares.z + t)};
        const double f = squares.x * g.x * g.x + squares.y * g.y * g.y + squares.z * g.z * g.z - 1;
        const double slope =
            -2 * (squares.x * g.x * g.x / (squares.x + t) + squares.y * g.y * g.y / (squares.y + t) +
                  squares.z * g.z * g.z / (squares.z + t));
        const double step = f / slope;
        t = std::max(t - step, -0.9 * scale);
        if (std::abs(step) < 1e-15 * scale) break;
    }
    const Vec3 g{x.x / (squares.x + t), x.y / (squares.y + t), x.z / (squares.z + t)};
    return {{squares.x * g.x, squares.y * g.y, squares.z * g.z}, t * length(g), normalized(g)};
}

Raster::Located in_block(const MapBlock& block, std::size_t n) {
    return {{block.place_x[n], block.place_y[n]}, {block.density_x[n], block.density_y[n]}};
}

/// Largest angle between the normal and the direction from the centre.
double largest_tilt(Vec3 radii) {
    const double a = std::max({radii.x, radii.y, radii.z}), c = std::min({radii.x, radii.y, radii.z});
    return std::atan2(a * a - c * c, 2 * a * c);
}

} // namespace

RasterLayer::RasterLayer(const SurfaceDomain& domain, HeightRaster source,
                         std::shared_ptr<const Coverage> coverage, double feather_m)
    : domain_(domain), source_(std::move(source)), coverage_(std::move(coverage)), feather_m_(feather_m) {}

double RasterLayer::footprint(Vec3 position_m, double spacing_m) const {
    return domain_.is_plane() ? spacing_m : spacing_m / length(position_m);
}

double RasterLayer::weight(const Raster::Located& located, double metres_per_radian) const {
    if (!coverage_) return 1;
    const double metres = coverage_->distance(located) * metres_per_radian;
    return feather_m_ > 0 ? smoothstep(metres / feather_m_) : metres > 0 ? 1 : 0;
}

double RasterLayer::along_normal_m(Raster::Reader& reader, Vec3 position_m, double spacing_m) const {
    const Vec3 up = normalized(position_m);
    double height = 0;
    for (int k = 0; k < 12; ++k) {
        const Foot foot = foot_of(position_m + height * up, domain_.radii_m());
        const double wanted =
            source_.offset_m + source_.scale_m * reader.at(foot.point, footprint(foot.point, spacing_m));
        const double step = (wanted - foot.height_m) / dot(foot.normal, up);
        height += step;
        if (!(std::abs(step) > 1e-7)) break; // or there is no sample
    }
    return height;
}

double RasterLayer::height_m(Raster::Reader& reader, Vec3 position_m, double spacing_m) const {
    if (source_.meaning == HeightMeaning::normal && !domain_.is_plane())
        return along_normal_m(reader, position_m, spacing_m);
    const double value = source_.offset_m + source_.scale_m * reader.sample(located(position_m),
                                                                            footprint(position_m, spacing_m));
    const bool radius = source_.meaning == HeightMeaning::radius && !domain_.is_plane();
    return radius ? value - length(position_m) : value;
}

Raster::Located RasterLayer::located(Vec3 position_m) const {
    if (domain_.is_plane() && !coverage_) { // margins of tiles go beyond the plane's edge
        const double edge = domain_.half_edge_m();
        position_m = {std::clamp(position_m.x, -edge, edge), std::clamp(position_m.y, -edge, edge), 0};
    }
    return source_.raster->locate(position_m);
}

void RasterLayer::load(std::span<const Vec3> positions, MapBlock& block) const {
    block.load(positions);
    if (domain_.is_plane() && !coverage_) { // as located()
        const double edge = domain_.half_edge_m();
        for (std::size_t n = 0; n < map_block_size; ++n) {
            block.x[n] = std::clamp(block.x[n], -edge, edge);
            block.y[n] = std::clamp(block.y[n], -edge, edge);
        }
    }
    source_.raster->frame().locate(block);
}

bool RasterLayer::covers(const Cap& cap) const {
    if (!coverage_) return true;
    const double away = length(cap.centre_m);
    const bool plane = domain_.is_plane();
    if (!plane && cap.radius_m >= away) return false;
    const double radius = plane ? cap.radius_m : std::asin(cap.radius_m / away);
    const double nearest = plane ? 1 : away - cap.radius_m;
    const double metres = coverage_->min_distance(cap.centre_m, radius) * nearest;
    return metres > 0 && metres >= feather_m_;
}

HeightRange RasterLayer::bounds(const Cap& cap, double spacing_m) const {
    const double away = length(cap.centre_m);
    const Vec3 radii = domain_.radii_m();
    const double min_radius = std::min({radii.x, radii.y, radii.z});
    const double largest_radius = std::max({radii.x, radii.y, radii.z});
    double radius = cap.radius_m, spread = spacing_m;
    double tilt = 0;
    if (!domain_.is_plane()) {
        radius = cap.radius_m < away ? std::asin(cap.radius_m / away) : std::numbers::pi;
        spread = spacing_m / min_radius;
        if (source_.meaning == HeightMeaning::normal) {
            tilt = largest_tilt(radii);
            const SamplePyramid& samples = source_.raster->samples();
            const double highest =
                std::abs(source_.offset_m) +
                source_.scale_m * std::max(std::abs(static_cast<double>(samples.least())),
                                           std::abs(static_cast<double>(samples.largest())));
            radius += 1.6 * highest * std::sin(tilt) / (min_radius - std::min(highest, 0.5 * min_radius));
        }
    }
    const Raster& raster = *source_.raster;
    const SampleRange range = raster.range(raster.area(cap.centre_m, radius), cap.centre_m, radius, spread);
    const double least = source_.offset_m + source_.scale_m * static_cast<double>(range.least);
    const double largest = source_.offset_m + source_.scale_m * static_cast<double>(range.largest);
    const Raster::Densities densities = raster.densities(cap.centre_m, radius);
    const double pixel =
        (domain_.is_plane() ? 1 : largest_radius) / std::min(densities.least.x, densities.least.y);
    // A share of the heights that rounding takes.
    const double rounding =
        1e-9 * std::max(std::abs(least), std::abs(largest)) + (domain_.is_plane() ? 0 : 1e-6);
    if (source_.meaning == HeightMeaning::radius && !domain_.is_plane())
        return {least - std::min(away + cap.radius_m, largest_radius) - rounding,
                largest - std::max(away - cap.radius_m, min_radius) + rounding, pixel};
    const double longer = 1 / std::cos(tilt);
    return {std::min(least, least * longer) - rounding, std::max(largest, largest * longer) + rounding,
            pixel};
}

HeightRange RasterLayer::range(const Cap& cap, double spacing_m, HeightRange below) const {
    const HeightRange own = bounds(cap, spacing_m);
    if (!coverage_) return own;
    if (!(own.least <= own.largest)) return below;
    if (covers(cap)) return own;
    return {std::min(below.least, own.least), std::max(below.largest, own.largest),
            std::max(below.sample_spacing_m, own.sample_spacing_m)};
}

double RasterLayer::sample_spacing_m(Vec3 position_m) const {
    const double metres = domain_.is_plane() ? 1 : length(position_m);
    const Raster::Located at = located(position_m);
    return weight(at, metres) > 0 ? at.pixel() * metres : std::numeric_limits<double>::infinity();
}

void RasterLayer::add_lost_slopes(std::span<const Vec3> positions_m, double spacing_m,
                                  std::span<const double> /*sample_spacings_m*/,
                                  std::span<double> lost) const {
    const Raster& raster = *source_.raster;
    std::call_once(slopes_made_,
                   [&] { slopes_ = std::make_unique<SlopeLevels>(raster.samples(), raster.frame()); });
    for (std::size_t n = 0; n < positions_m.size(); ++n) {
        const Raster::Located at = located(positions_m[n]);
        const double metres = domain_.is_plane() ? 1 : length(positions_m[n]);
        const double w = weight(at, metres);
        if (!(w > 0)) continue;
        const double per = source_.scale_m / metres;
        const double own =
            per * per * slopes_->lost(at.place, at.density.y * footprint(positions_m[n], spacing_m));
        lost[n] += w * (own - lost[n]);
    }
}

void RasterLayer::apply(const VertexGrid& grid, std::span<double> heights_m,
                        std::span<double> sample_spacings_m) const {
    if (coverage_) {
        const HeightRange own = bounds(grid.cap, grid.spacing_m);
        if (!(own.least <= own.largest)) return;
    }
    Raster::Reader reader(*source_.raster);
    MapBlock block;
    std::array<double, map_block_size> footprints, samples, shares;
    const bool plane = domain_.is_plane();
    const bool along_normal = source_.meaning == HeightMeaning::normal && !plane;
    const bool radius = source_.meaning == HeightMeaning::radius && !plane;
    const bool whole = covers(grid.cap);
    for (std::size_t begin = 0; begin < grid.positions_m.size(); begin += map_block_size) {
        const auto positions =
            grid.positions_m.subspan(begin, std::min(map_block_size, grid.positions_m.size() - begin));
        load(positions, block);
        bool any = false;
        for (std::size_t n = 0; n < block.count; ++n) {
            footprints[n] = plane ? grid.spacing_m : grid.spacing_m / block.distance[n];
            shares[n] = whole ? 1 : weight(in_block(block, n), plane ? 1 : block.distance[n]);
            any = any || shares[n] > 0;
        }
        if (!any) continue;
        if (along_normal)
            for (std::size_t n = 0; n < block.count; ++n)
                samples[n] = shares[n] > 0 ? along_normal_m(reader, positions[n], grid.spacing_m) : 0;
        else
            reader.sample(block, footprints, samples);
        for (std::size_t n = 0; n < block.count; ++n) {
            const double w = shares[n];
            double height = samples[n];
            if (!along_normal) height = source_.offset_m + source_.scale_m * height;
            if (radius) height -= block.distance[n];
            if (!(w > 0) || std::isnan(height)) continue;
            double& h = heights_m[begin + n];
            double& spacing = sample_spacings_m[begin + n];
            const double own = in_block(block, n).pixel() * (plane ? 1 : block.distance[n]);
            h = w < 1 ? h + w * (height - h) : height;
            spacing = w < 1 ? 1 / ((1 - w) / spacing + w / own) : own;
        }
    }
}

} // namespace obscura::terrain
