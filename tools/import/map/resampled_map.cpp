// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/resampled_map.hpp"

#include "core/error.hpp"
#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace obscura::tools {
namespace {

using terrain::MapFrame;
using terrain::Projection;
using terrain::ProjectionKind;
using terrain::SamplePlace;

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr int map_block_edge = 256;
/// Samples of the file that are read for a block.
constexpr double max_source_samples = 4e6;

SamplePlace pixel_of(const std::array<double, 6>& t, double x, double y) {
    const double determinant = t[1] * t[5] - t[2] * t[4], dx = x - t[0], dy = y - t[3];
    return {(dx * t[5] - dy * t[2]) / determinant, (dy * t[1] - dx * t[4]) / determinant};
}

std::array<double, 4> catmull_rom(double f) {
    return {((-0.5 * f + 1) * f - 0.5) * f, (1.5 * f - 2.5) * f * f + 1, ((-1.5 * f + 2) * f + 0.5) * f,
            (0.5 * f - 0.5) * f * f};
}

/// Samples of the file around the places of a block.
struct Window {
    std::int64_t x = 0, y = 0;
    int columns = 0, rows = 0;
    std::vector<float> samples;
    [[nodiscard]] float at(std::int64_t column, std::int64_t row) const {
        if (column < x || row < y || column >= x + columns || row >= y + rows)
            return std::numeric_limits<float>::quiet_NaN();
        return samples[static_cast<std::size_t>(row - y) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(column - x)];
    }
};

float interpolated(const Window& window, SamplePlace at) {
    const double fx = std::floor(at.x), fy = std::floor(at.y);
    const auto x = static_cast<std::int64_t>(fx), y = static_cast<std::int64_t>(fy);
    const auto wx = catmull_rom(at.x - fx), wy = catmull_rom(at.y - fy);
    double sum = 0;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
            sum += wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)] *
                   static_cast<double>(window.at(x + i - 1, y + j - 1));
    if (std::isfinite(sum)) return static_cast<float>(sum);
    double weight = 0;
    sum = 0;
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const float v = window.at(x + i, y + j);
            const double w = std::abs(1 - i - (at.x - fx)) * std::abs(1 - j - (at.y - fy));
            if (std::isnan(v)) continue;
            sum += w * static_cast<double>(v);
            weight += w;
        }
    return weight < 0.5 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(sum / weight);
}

/// Direction of a longitude and a latitude in degrees.
Vec3 direction(const std::array<double, 2>& at) {
    const double b = at[1] * degree, l = at[0] * degree;
    return Vec3{std::cos(b) * std::cos(l), std::cos(b) * std::sin(l), std::sin(b)};
}

Projection ellipsoid_of(const MapSource& source, const MapSettings& settings) {
    const GdalMap& map = source.map();
    Projection p;
    const Vec3 radii =
        source.place().radii_m.x > 0 ? source.place().radii_m : settings.radii_m.value_or(Vec3{});
    p.equatorial_radius_m = map.semi_major_m > 0 ? map.semi_major_m : radii.x;
    p.polar_radius_m = map.semi_minor_m > 0 ? map.semi_minor_m : p.equatorial_radius_m;
    if (!(p.equatorial_radius_m > 0)) throw InputError(source.name() + ": its projection has no radius");
    if (p.polar_radius_m != p.equatorial_radius_m) p.latitudes = terrain::Latitudes::planetographic;
    return p;
}

/// What of the body a map shows, and how far neighbours are apart.
struct MapExtent {
    std::vector<std::array<double, 2>> places; ///< longitude and latitude, each second that of a neighbour
    std::vector<double> longitudes;            ///< 0 to 360 degrees
    double south = 90, north = -90;
    double step_rad = 0; ///< median
    bool has_pole[2] = {false, false};
};

MapExtent extent_of(const std::string& name, std::vector<std::array<double, 2>> found) {
    MapExtent extent;
    auto& [places, longitudes, south, north, step_rad, has_pole] = extent;
    std::vector<double> steps;
    for (std::size_t i = 0; i + 1 < found.size(); i += 2) {
        if (!std::isfinite(found[i][0]) || !std::isfinite(found[i + 1][0])) continue;
        steps.push_back(length(direction(found[i]) - direction(found[i + 1])));
        longitudes.push_back(found[i][0] - 360 * std::floor(found[i][0] / 360));
        south = std::min(south, found[i][1]);
        north = std::max(north, found[i][1]);
    }
    if (steps.size() < 4) throw InputError(name + ": PROJ finds no place for its samples");
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                     steps.end());
    step_rad = steps[steps.size() / 2];
    if (!(step_rad > 1e-12)) throw InputError(name + ": its pixels have no size");
    places = std::move(found);
    return extent;
}

/// Polar stereographic, about the pole that the map has.
MapFrame polar_frame(Projection p, const MapExtent& extent) {
    const auto& [found, longitudes, south, north, step_rad, has_pole] = extent;
    p = [&] {
        Projection q = Projection::of_sphere(extent.has_pole[0] ? ProjectionKind::north_polar_stereographic
                                                                : ProjectionKind::south_polar_stereographic,
                                             p.equatorial_radius_m);
        q.polar_radius_m = p.polar_radius_m;
        q.latitudes = p.latitudes;
        return q;
    }();
    const double step = step_rad * p.equatorial_radius_m;
    double left = 0, right = 0, bottom = 0, top = 0;
    for (std::size_t i = 0; i < found.size(); i += 2) {
        if (!std::isfinite(found[i][0])) continue;
        const double flat = p.polar_radius_m / p.equatorial_radius_m;
        Vec3 d = direction(found[i]);
        if (p.latitudes == terrain::Latitudes::planetographic) d.z *= flat * flat;
        const terrain::MapPoint at = p.forward(d);
        left = std::min(left, at.x_m);
        right = std::max(right, at.x_m);
        bottom = std::min(bottom, at.y_m);
        top = std::max(top, at.y_m);
    }
    const auto pixels = [&](double from, double to) {
        return std::max<std::int64_t>(1, std::llround(std::ceil((to - from) / step)));
    };
    return MapFrame(p, {left, step, 0, top, 0, -step}, terrain::Registration::pixel, pixels(left, right),
                    pixels(bottom, top));
}

/// Simple cylindrical.
MapFrame cylindrical_frame(const Projection& p, MapExtent extent) {
    auto& [found, longitudes, south, north, step_rad, has_pole] = extent;
    std::sort(longitudes.begin(), longitudes.end());
    double widest = longitudes.front() + 360 - longitudes.back(), west = longitudes.front(),
           east = longitudes.back();
    for (std::size_t i = 1; i < longitudes.size(); ++i)
        if (longitudes[i] - longitudes[i - 1] > widest) {
            widest = longitudes[i] - longitudes[i - 1];
            west = longitudes[i];
            east = longitudes[i - 1] + 360;
        }
    const double step_deg = step_rad / degree;
    if (has_pole[0] || has_pole[1] || widest < std::max(8.0, 2 * step_deg)) {
        west = 0;
        east = 360;
    }
    const auto pixels = [&](double from, double to) {
        return std::max<std::int64_t>(1, std::llround(std::ceil((to - from) / step_deg - 1e-6)));
    };
    const std::int64_t columns = pixels(west, east), rows = pixels(south, north);
    if (east - west < 359.999) east = west + static_cast<double>(columns) * step_deg;
    if (north < 89.999 || south > -89.999)
        south = std::max(-90.0, north - static_cast<double>(rows) * step_deg);
    return MapFrame::by_edges(p, terrain::Registration::pixel, columns, rows, west * degree, east * degree,
                              north * degree, south * degree);
}

} // namespace

std::vector<SamplePlace> ResampledMap::places_of(std::vector<std::array<double, 2>> degrees) const {
    const auto answers = source_.process().transform({source_.map().id, false, std::move(degrees)});
    std::vector<SamplePlace> out;
    out.reserve(answers.size());
    const GdalMap& map = source_.map();
    // PROJ's longitudes are within half a turn of its meridian, those of the file need not be.
    const double turn = map.system == GdalSystem::geographic ? 360 / map.degrees_per_unit : 0;
    for (const auto& [x, y] : answers) {
        SamplePlace at = pixel_of(*map.transform, x, y);
        for (const double other : {x - turn, x + turn}) {
            if (turn == 0 || (at.x >= 0 && at.x <= static_cast<double>(map.width))) break;
            const SamplePlace there = pixel_of(*map.transform, other, y);
            if (there.x >= 0 && there.x <= static_cast<double>(map.width)) at = there;
        }
        out.push_back({at.x - 0.5, at.y - 0.5});
    }
    return out;
}

/// Longitude and latitude of a place of the file (0, 0 at the corner of the first pixel); NaN: none.
std::array<double, 2> ResampledMap::degrees_at(double x, double y) const {
    const auto& t = *source_.map().transform;
    return {t[0] + t[1] * x + t[2] * y, t[3] + t[4] * x + t[5] * y};
}

/// Longitudes and latitudes of a grid of the file's pixels, each followed by that of a neighbour.
std::vector<std::array<double, 2>> ResampledMap::sampled_places() const {
    const GdalMap& map = source_.map();
    const double width = static_cast<double>(map.width), height = static_cast<double>(map.height);
    constexpr int grid = 65;
    GdalTransform request{map.id, true, {}};
    for (int j = 0; j < grid; ++j)
        for (int i = 0; i < grid; ++i) {
            const double x = std::min(width * i / (grid - 1), width - 1e-6),
                         y = std::min(height * j / (grid - 1), height - 1e-6);
            request.points.push_back(degrees_at(x, y));
            request.points.push_back(degrees_at(x < 1 ? x + 1 : x - 1, y));
        }
    return source_.process().transform(request);
}

ResampledMap::ResampledMap(MapSource& source, const MapSettings& settings, MapRemarks& remarks)
    : source_(source) {
    const GdalMap& map = source.map();
    if (!map.transform || map.system == GdalSystem::none || map.system == GdalSystem::local)
        throw InputError(fmt::format(
            "{}: its projection is not known: --edges LEFT,RIGHT,TOP,BOTTOM says where its samples are",
            source.name()));
    const std::array<double, 2> size{static_cast<double>(map.width), static_cast<double>(map.height)};
    std::vector<std::array<double, 2>> found = sampled_places();
    const Projection p = ellipsoid_of(source, settings);
    MapExtent extent = extent_of(source.name(), std::move(found));
    const auto poles = places_of({{0, 89.99999}, {0, -89.99999}});
    for (std::size_t i = 0; i < 2; ++i)
        extent.has_pole[i] =
            poles[i].x > -1 && poles[i].y > -1 && poles[i].x < size[0] && poles[i].y < size[1];
    if (extent.has_pole[0]) extent.north = 90;
    if (extent.has_pole[1]) extent.south = -90;
    const bool about_pole = extent.has_pole[0] != extent.has_pole[1] &&
                            (extent.has_pole[0] ? extent.south > 0 : extent.north < 0);
    try {
        frame_ = about_pole ? polar_frame(p, extent) : cylindrical_frame(p, extent);
    } catch (const std::invalid_argument& error) {
        throw InputError(
            fmt::format("{}: its projection cannot be resampled: {} (gdalwarp makes a map of it)",
                        source.name(), error.what()));
    }
    find_period();
    const bool turned = (*map.transform)[2] != 0 || (*map.transform)[4] != 0;
    remarks.note(fmt::format("{}: {}: resampled to {}, {} x {} samples", source.name(),
                             turned ? "its rows do not follow parallels"
                                    : fmt::format("its projection ({}) is not one that textures have",
                                                  map.method.empty() ? "unnamed" : map.method),
                             about_pole ? "polar stereographic" : "simple cylindrical", frame_.width(),
                             frame_.height()));
}

void ResampledMap::find_period() {
    const GdalMap& map = source_.map();
    const bool meridians_are_columns = map.method.find("Mercator_") == 0 ||
                                       map.method == "Cylindrical_Equal_Area" ||
                                       map.method == "Miller_Cylindrical" ||
                                       map.method == "Gall_Stereographic" || map.method == "Equirectangular";
    if (!meridians_are_columns || (*map.transform)[2] != 0 || (*map.transform)[4] != 0) return;
    double centre = 0;
    for (const auto& [name, value] : map.parameters)
        if (name == "central_meridian") centre = value;
    const auto ends = places_of({{centre - 90, 0}, {centre + 90, 0}});
    const double turn = 2 * std::abs(ends[1].x - ends[0].x);
    if (std::abs(turn - static_cast<double>(map.width)) < 0.5) period_ = turn;
}

std::vector<SamplePlace> ResampledMap::places(const Block& block) const {
    std::vector<std::array<double, 2>> degrees;
    degrees.reserve(static_cast<std::size_t>(block.columns) * static_cast<std::size_t>(block.rows));
    const Projection& p = frame_.projection();
    for (int j = 0; j < block.rows; ++j)
        for (int i = 0; i < block.columns; ++i) {
            const Vec3 at =
                frame_.position({static_cast<double>(block.x + i), static_cast<double>(block.y + j)});
            degrees.push_back({p.longitude_rad(at) / degree - source_.map().prime_meridian_deg,
                               p.latitude_rad(at) / degree});
        }
    std::vector<SamplePlace> out = places_of(std::move(degrees));
    const double width = static_cast<double>(source_.width()), height = static_cast<double>(source_.height());
    for (SamplePlace& at : out) {
        if (period_ > 0) at.x -= period_ * std::floor((at.x + 0.5) / period_);
        if (!(at.x >= -0.5001 && at.y >= -0.5001 && at.x <= width - 0.4999 && at.y <= height - 0.4999))
            at = {none, none};
    }
    return out;
}

void ResampledMap::resample(std::uint32_t plane, const Block& block, float* out, std::size_t stride) {
    std::vector<SamplePlace> at = places(block);
    double left = std::numeric_limits<double>::infinity(), right = -left, top = left, bottom = -left;
    double middle = none;
    for (SamplePlace& place : at) {
        if (std::isnan(place.x)) continue;
        if (std::isnan(middle)) middle = place.x;
        // Samples on both sides of the edge are read together.
        if (period_ > 0) place.x += period_ * std::round((middle - place.x) / period_);
        left = std::min(left, place.x);
        right = std::max(right, place.x);
        top = std::min(top, place.y);
        bottom = std::max(bottom, place.y);
    }
    const auto fill = [&] {
        for (int j = 0; j < block.rows; ++j)
            std::fill_n(out + static_cast<std::size_t>(j) * stride, block.columns,
                        std::numeric_limits<float>::quiet_NaN());
    };
    if (std::isnan(middle)) return fill();
    // A block on both sides of a cut of the projection takes in much of the file.
    const double area = (right - left + 4) * (bottom - top + 4);
    if (area > max_source_samples && (block.columns > 1 || block.rows > 1)) {
        const int c = std::max(1, block.columns / 2), r = std::max(1, block.rows / 2);
        for (int j = 0; j < block.rows; j += r)
            for (int i = 0; i < block.columns; i += c)
                resample(
                    plane,
                    {block.x + i, block.y + j, std::min(c, block.columns - i), std::min(r, block.rows - j)},
                    out + static_cast<std::size_t>(j) * stride + static_cast<std::size_t>(i), stride);
        return;
    }
    Window window;
    const std::int64_t width = source_.width(), height = source_.height();
    window.x = static_cast<std::int64_t>(std::floor(left)) - 1;
    window.y = std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(top)) - 1);
    std::int64_t end_x = static_cast<std::int64_t>(std::floor(right)) + 3;
    const std::int64_t end_y =
        std::min<std::int64_t>(height, static_cast<std::int64_t>(std::floor(bottom)) + 3);
    if (period_ == 0) {
        window.x = std::max<std::int64_t>(0, window.x);
        end_x = std::min(width, end_x);
    }
    window.columns = static_cast<int>(end_x - window.x);
    window.rows = static_cast<int>(end_y - window.y);
    if (window.columns <= 0 || window.rows <= 0) return fill();
    window.samples.resize(static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows));
    // Pieces that lie between whole turns.
    std::vector<float> piece;
    for (std::int64_t x = window.x; x < end_x;) {
        const std::int64_t inside = ((x % width) + width) % width;
        const std::int64_t count = std::min(end_x - x, width - inside);
        piece.resize(static_cast<std::size_t>(count * window.rows));
        source_.read(plane, inside, window.y, static_cast<int>(count), window.rows, piece);
        for (int j = 0; j < window.rows; ++j)
            std::copy_n(piece.begin() + static_cast<std::ptrdiff_t>(j * count), count,
                        window.samples.begin() +
                            static_cast<std::ptrdiff_t>(std::int64_t{j} * window.columns + x - window.x));
        x += count;
    }
    for (int j = 0; j < block.rows; ++j)
        for (int i = 0; i < block.columns; ++i) {
            const SamplePlace& place =
                at[static_cast<std::size_t>(j) * static_cast<std::size_t>(block.columns) +
                   static_cast<std::size_t>(i)];
            out[static_cast<std::size_t>(j) * stride + static_cast<std::size_t>(i)] =
                std::isnan(place.x) ? std::numeric_limits<float>::quiet_NaN() : interpolated(window, place);
        }
}

void ResampledMap::read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                        std::span<float> out) {
    for (int j = 0; j < rows; j += map_block_edge)
        for (int i = 0; i < columns; i += map_block_edge)
            resample(
                plane,
                {x + i, y + j, std::min(map_block_edge, columns - i), std::min(map_block_edge, rows - j)},
                out.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(i),
                static_cast<std::size_t>(columns));
}

} // namespace obscura::tools
