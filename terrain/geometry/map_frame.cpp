// SPDX-License-Identifier: Apache-2.0
#include "terrain/geometry/map_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace obscura::terrain {
namespace {

/// Columns by which a map may miss a full turn, and rows by which it may miss a pole, and still be whole:
/// transforms of labels are rounded.
constexpr double whole_samples = 1e-3;

/// Distance of samples from the origin of the transform, in pixels.
double offset_of(Registration registration) {
    return registration == Registration::pixel ? 0.5 : 0;
}

} // namespace

MapFrame::MapFrame(const Projection& projection, const PixelTransform& transform, Registration registration,
                   std::int64_t width, std::int64_t height)
    : projection_(projection),
      transform_(transform),
      registration_(registration),
      width_(width),
      height_(height),
      determinant_(transform[1] * transform[5] - transform[2] * transform[4]) {
    const Projection& p = projection;
    const bool finite = std::all_of(transform.begin(), transform.end(),
                                    [](double v) { return std::isfinite(v) && std::abs(v) < 1e15; });
    if (!finite || !std::isnormal(determinant_) || width < 1 || height < 1)
        throw std::invalid_argument("the transform of its pixels to the map cannot be inverted");
    if (!(p.equatorial_radius_m > 0 && p.equatorial_radius_m < 1e12 && p.polar_radius_m > 0 &&
          p.polar_radius_m <= p.equatorial_radius_m && std::isfinite(p.centre_longitude_rad) &&
          std::abs(p.true_scale_latitude_rad) <= std::numbers::pi / 2 + 1e-9))
        throw std::invalid_argument("a map on a spheroid whose radii or parallels are out of range");
    first_pole_y_ = last_pole_y_ = std::numeric_limits<double>::quiet_NaN();
    if (p.kind != ProjectionKind::simple_cylindrical) {
        make_formula();
        return;
    }
    if (transform[2] != 0 || transform[4] != 0)
        throw std::invalid_argument("a simple cylindrical map whose rows do not follow parallels");
    if (!(std::cos(p.true_scale_latitude_rad) > 1e-6))
        throw std::invalid_argument("a simple cylindrical map with true scale at a pole");
    const double offset = offset_of(registration);
    const double turn = std::abs(p.turn_m() / transform[1]);
    const auto columns = static_cast<double>(width), rows = static_cast<double>(height);
    // A grid of nodes often has its first column again as its last.
    if (columns > turn - whole_samples) period_ = turn;
    if (columns > turn + 1 + whole_samples)
        throw std::invalid_argument(
            fmt::format("a map of {} columns of which {:.6g} are a full turn", width, turn));
    middle_x_m_ = transform[0] + transform[1] * (columns / 2 - 0.5 + offset);
    for (const double pole : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
        const double y = (p.equatorial_radius_m * pole - transform[3]) / transform[5] - offset;
        const double first = -0.5, last = rows - 0.5; // outer edges of the pixels
        const double node_first = 0, node_last = rows - 1;
        const bool node = registration == Registration::node;
        if (y > 0.5 && y < rows - 1.5)
            throw std::invalid_argument(
                fmt::format("a map of {} rows that crosses a pole at row {:.6g}", height, y));
        if (std::abs(y - (node ? node_first : first)) < whole_samples) first_pole_y_ = y;
        if (std::abs(y - (node ? node_last : last)) < whole_samples) last_pole_y_ = y;
    }
    // Exactly, so that a row and its continuation beyond the pole meet.
    const auto snap = [](double y) { return std::round(2 * y) / 2; };
    if (!std::isnan(first_pole_y_)) first_pole_y_ = snap(first_pole_y_);
    if (!std::isnan(last_pole_y_)) last_pole_y_ = snap(last_pole_y_);
    make_formula();
}

void MapFrame::make_formula() {
    const Projection& p = projection_;
    const PixelTransform& t = transform_;
    MapFormula& f = formula_;
    const bool spheroid =
        p.latitudes == Latitudes::planetographic && p.equatorial_radius_m != p.polar_radius_m;
    const double offset = offset_of(registration_);
    f.xx = t[5] / determinant_;
    f.xy = -t[2] / determinant_;
    f.yx = -t[4] / determinant_;
    f.yy = t[1] / determinant_;
    f.x0 = -(f.xx * t[0] + f.xy * t[3]) - offset;
    f.y0 = -(f.yx * t[0] + f.yy * t[3]) - offset;
    f.density_x = 1 / std::hypot(t[1], t[4]);
    f.density_y = 1 / std::hypot(t[2], t[5]);
    switch (p.kind) {
    case ProjectionKind::planar:
        f.kind = MapFormula::Kind::planar;
        return;
    case ProjectionKind::simple_cylindrical: {
        const double flat = spheroid ? p.equatorial_radius_m / p.polar_radius_m : 1;
        f.kind = MapFormula::Kind::cylindrical;
        f.latitude_z = flat * flat;
        f.scale_x = p.equatorial_radius_m * std::cos(p.true_scale_latitude_rad);
        f.scale_y = p.equatorial_radius_m;
        f.middle_x = middle_x_m_;
        f.turn = p.turn_m();
        f.centre_x = f.scale_x * p.centre_longitude_rad;
        return;
    }
    case ProjectionKind::north_polar_stereographic:
    case ProjectionKind::south_polar_stereographic:
        if (spheroid) return; // its conformal latitudes need powers
        f.kind = MapFormula::Kind::polar;
        f.sine_sign = p.kind == ProjectionKind::north_polar_stereographic ? 1 : -1;
        f.scale_x = p.polar_distance_m(0);
        f.cosine = std::cos(p.centre_longitude_rad);
        f.sine = std::sin(p.centre_longitude_rad);
        return;
    }
}

void MapFrame::locate(MapBlock& block) const {
    terrain::locate(formula_, block);
    if (formula_.kind != MapFormula::Kind::none) return;
    for (std::size_t n = 0; n < block.count; ++n) {
        const Vec3 p{block.x[n], block.y[n], block.z[n]};
        const SamplePlace at = place(p), density = samples_per_radian(p);
        block.place_x[n] = at.x;
        block.place_y[n] = at.y;
        block.density_x[n] = density.x;
        block.density_y[n] = density.y;
    }
}

MapFrame MapFrame::by_edges(Projection projection, Registration registration, std::int64_t width,
                            std::int64_t height, double left_rad, double right_rad, double top_rad,
                            double bottom_rad) {
    const auto intervals = [&](std::int64_t samples) {
        return static_cast<double>(
            registration == Registration::pixel ? samples : std::max<std::int64_t>(samples - 1, 1));
    };
    projection.kind = ProjectionKind::simple_cylindrical;
    projection.true_scale_latitude_rad = 0;
    projection.centre_longitude_rad = 0.5 * (left_rad + right_rad);
    const double r = projection.equatorial_radius_m;
    const double half = 0.5 * (right_rad - left_rad);
    return {projection,
            {-r * half, 2 * r * half / intervals(width), 0, r * top_rad, 0,
             r * (bottom_rad - top_rad) / intervals(height)},
            registration,
            width,
            height};
}

SamplePlace MapFrame::place(Vec3 p) const {
    const MapPoint at = projection_.forward(p);
    double dx = at.x_m - transform_[0];
    if (projection_.kind == ProjectionKind::simple_cylindrical)
        dx = middle_x_m_ + std::remainder(at.x_m - middle_x_m_, projection_.turn_m()) - transform_[0];
    const double dy = at.y_m - transform_[3];
    const double offset = offset_of(registration_);
    return {(dx * transform_[5] - dy * transform_[2]) / determinant_ - offset,
            (dy * transform_[1] - dx * transform_[4]) / determinant_ - offset};
}

Vec3 MapFrame::position(SamplePlace place) const {
    const double offset = offset_of(registration_);
    const double column = place.x + offset, row = place.y + offset;
    return projection_.inverse({transform_[0] + transform_[1] * column + transform_[2] * row,
                                transform_[3] + transform_[4] * column + transform_[5] * row});
}

SamplePlace MapFrame::samples_per_radian(Vec3 p) const {
    const MapPoint scale = projection_.metres_per_radian(p);
    if (projection_.kind == ProjectionKind::simple_cylindrical)
        return {scale.x_m / std::abs(transform_[1]), scale.y_m / std::abs(transform_[5])};
    // Length of a step of a column and of a row on the map.
    return {scale.x_m / std::hypot(transform_[1], transform_[4]),
            scale.y_m / std::hypot(transform_[2], transform_[5])};
}

SamplePlace MapFrame::step(Vec3 p, Vec3 step_m) const {
    const MapPoint on_map = projection_.step(p, step_m);
    return {(on_map.x_m * transform_[5] - on_map.y_m * transform_[2]) / determinant_,
            (on_map.y_m * transform_[1] - on_map.x_m * transform_[4]) / determinant_};
}

} // namespace obscura::terrain
