// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/height_stack.hpp"

#include "core/error.hpp"
#include "terrain/maps/patch_overlap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace obscura::terrain {
namespace {

/// Throws unless the source has heights everywhere.
void require_whole(const SurfaceDomain& domain, const HeightSource& source) {
    const Raster& raster = *source.raster.raster;
    const MapFrame& frame = raster.frame();
    const std::string rest =
        "and no source below it fills that; "
        "give a source of the whole body with a lower `priority`, or fill its holes with `obscura import map --fill gaussian`";
    if (raster.samples().has_holes())
        throw InputError(fmt::format("{}: has pixels without data, {}", source.name, rest));
    if (domain.is_plane()) {
        const double edge = domain.half_edge_m();
        for (const Vec3 corner :
             {Vec3{-edge, -edge, 0}, Vec3{edge, -edge, 0}, Vec3{-edge, edge, 0}, Vec3{edge, edge, 0}})
            if (!raster.inside(frame.place(corner)))
                throw InputError(
                    fmt::format("{}: does not cover the corner x {:.6g} m, y {:.6g} m of the terrain, {}",
                                source.name, corner.x, corner.y, rest));
        return;
    }
    if (raster.whole()) return;
    for (const double latitude : {90.0, -90.0, 60.0, -60.0, 0.0})
        for (double longitude = -180; longitude < 180; longitude += 0.25) {
            const double b = latitude * std::numbers::pi / 180, l = longitude * std::numbers::pi / 180;
            const Vec3 p{std::cos(b) * std::cos(l), std::cos(b) * std::sin(l), std::sin(b)};
            if (!raster.inside(frame.place(p)))
                throw InputError(
                    fmt::format("{}: does not reach longitude {:.6g}, latitude {:.6g} degrees, {}",
                                source.name, longitude, latitude, rest));
        }
    throw InputError(fmt::format(
        "{}: does not cover the whole body (simple cylindrical, 360 degrees of longitude, latitudes from -90 to 90), {}",
        source.name, rest));
}

Overlap compare(const SurfaceDomain& domain, const HeightSource& source,
                const std::vector<std::shared_ptr<const HeightLayer>>& below, double& largest_below_m) {
    const Raster& raster = *source.raster.raster;
    const std::vector<Vec3> positions = compared_points(domain, raster.frame());
    const RasterLayer own(domain, source.raster);
    Raster::Reader reader(raster);
    const std::vector<double> base = heights_at(below, positions, 0);
    Overlap overlap{source.name};
    double sum = 0, squares = 0;
    largest_below_m = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const double difference = own.height_m(reader, positions[i], 0) - base[i];
        if (!std::isfinite(difference)) continue;
        ++overlap.points;
        sum += difference;
        squares += difference * difference;
        for (const auto& layer : below) {
            const double spacing = layer->sample_spacing_m(positions[i]);
            if (std::isfinite(spacing)) largest_below_m = std::max(largest_below_m, spacing);
        }
    }
    if (overlap.points > 0) {
        const auto n = static_cast<double>(overlap.points);
        overlap.mean_m = sum / n;
        overlap.rms_m = std::sqrt(squares / n);
    }
    return overlap;
}

} // namespace

std::string to_string(const Overlap& overlap) {
    if (overlap.points == 0) return fmt::format("{}: not a pixel over the terrain", overlap.name);
    const std::string shift =
        overlap.shift_m != 0 ? fmt::format(", shifted by {:.2f} m", overlap.shift_m) : std::string();
    return fmt::format(
        "{}: minus what is below it, at {} points: mean {:.2f} m, rms {:.2f} m{}; blended over {:.4g} m",
        overlap.name, overlap.points, overlap.mean_m, overlap.rms_m, shift, overlap.feather_m);
}

std::vector<double> heights_at(const std::vector<std::shared_ptr<const HeightLayer>>& layers,
                               std::span<const Vec3> positions_m, double spacing_m) {
    std::vector<double> heights(positions_m.size(), 0.0);
    std::vector<double> spacings(positions_m.size(), std::numeric_limits<double>::infinity());
    VertexGrid grid;
    grid.positions_m = positions_m;
    grid.spacing_m = spacing_m;
    if (positions_m.empty()) return heights;
    grid.cap.centre_m = positions_m[positions_m.size() / 2];
    for (const Vec3 p : positions_m)
        grid.cap.radius_m = std::max(grid.cap.radius_m, length(p - grid.cap.centre_m));
    for (const auto& layer : layers)
        layer->apply(grid, heights, spacings);
    return heights;
}

HeightStack make_height_stack(const SurfaceDomain& domain, std::vector<HeightSource> sources) {
    std::stable_sort(sources.begin(), sources.end(),
                     [](const HeightSource& a, const HeightSource& b) { return a.priority < b.priority; });
    HeightStack stack;
    for (HeightSource& source : sources) {
        if (stack.layers.empty()) {
            require_whole(domain, source);
            stack.layers.push_back(std::make_shared<const RasterLayer>(domain, source.raster));
            continue;
        }
        double below_pixel_m = 0;
        Overlap overlap = compare(domain, source, stack.layers, below_pixel_m);
        if (source.match == PatchMatch::offset) {
            overlap.shift_m = -overlap.mean_m;
            source.raster.offset_m += overlap.shift_m;
        }
        const Raster& raster = *source.raster.raster;
        overlap.feather_m =
            source.feather_m.value_or(default_feather_m(domain, raster.frame(), below_pixel_m));
        std::shared_ptr<const Coverage> coverage;
        if (!raster.whole() || domain.is_plane())
            coverage = std::make_shared<const Coverage>(source.raster.raster);
        stack.layers.push_back(std::make_shared<const RasterLayer>(domain, source.raster, std::move(coverage),
                                                                   overlap.feather_m));
        stack.overlaps.push_back(std::move(overlap));
    }
    return stack;
}

} // namespace obscura::terrain
