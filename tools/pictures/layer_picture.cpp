// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/layer_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

namespace obscura::tools {
namespace {

enum class Shown : std::uint8_t { values, lengths, angles, cyclic_angles, classes, normal, error };

struct LayerRow {
    std::string_view name, plane, title;
    Shown shown;
};
constexpr LayerRow rows[] = {
    {.name = "depth", .plane = "depth_m", .title = "depth along the boresight", .shown = Shown::lengths},
    {.name = "range", .plane = "range_m", .title = "range from the camera", .shown = Shown::lengths},
    {.name = "normal",
     .plane = "normal.x",
     .title = "normal in inertial axes; -1 dark, +1 bright",
     .shown = Shown::normal},
    {.name = "slope",
     .plane = "slope_deg",
     .title = "slope: normal to direction from the origin",
     .shown = Shown::angles},
    {.name = "latitude", .plane = "latitude_deg", .title = "latitude", .shown = Shown::angles},
    {.name = "longitude", .plane = "longitude_deg", .title = "longitude", .shown = Shown::cyclic_angles},
    {.name = "incidence", .plane = "incidence_deg", .title = "incidence angle", .shown = Shown::angles},
    {.name = "emission", .plane = "emission_deg", .title = "emission angle", .shown = Shown::angles},
    {.name = "phase", .plane = "phase_deg", .title = "phase angle", .shown = Shown::angles},
    {.name = "albedo", .plane = "albedo", .title = "normal albedo", .shown = Shown::values},
    {.name = "body", .plane = "body", .title = "bodies", .shown = Shown::classes},
    {.name = "material", .plane = "material", .title = "materials", .shown = Shown::classes},
    {.name = "samples", .plane = "samples", .title = "samples per pixel", .shown = Shown::values},
    {.name = "error",
     .plane = "variance",
     .title = "estimated standard error of the irradiance",
     .shown = Shown::error},
};

std::span<const float> plane(const LayerPlanes& planes, std::string_view name) {
    const auto found = std::find_if(planes.planes.begin(), planes.planes.end(),
                                    [&](const images::FitsPlane& p) { return p.name == name; });
    assert(found != planes.planes.end());
    return found->values;
}

/// Smallest and largest finite value.
std::pair<double, double> limits(const std::vector<double>& values) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double v : values)
        if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    return low <= high ? std::pair{low, high} : std::pair{0.0, 1.0};
}

void paint_normal(const LayerPlanes& planes, Panel& panel) {
    const std::span<const float> x = plane(planes, "normal.x"), y = plane(planes, "normal.y"),
                                 z = plane(planes, "normal.z");
    const auto level = [](float v) {
        return static_cast<std::uint8_t>(
            std::lround(127.5 * (1 + std::clamp(static_cast<double>(v), -1.0, 1.0))));
    };
    for (std::size_t i = 0; i < x.size(); ++i)
        panel.pixels.push_back(std::isnan(x[i]) ? no_value_colour
                                                : Rgb{level(x[i]), level(y[i]), level(z[i])});
    panel.legend = {{{255, 128, 128}, "+x"}, {{0, 128, 128}, "-x"},   {{128, 255, 128}, "+y"},
                    {{128, 0, 128}, "-y"},   {{128, 128, 255}, "+z"}, {{128, 128, 0}, "-z"}};
}

void paint_classes(const LayerRow& row, const LayerPlanes& planes, Panel& panel) {
    std::map<std::int64_t, Rgb> seen;
    for (const float v : plane(planes, row.plane)) {
        const bool none = !(v > 0);
        const auto number = none ? 0 : std::llround(static_cast<double>(v));
        panel.pixels.push_back(none ? no_value_colour : class_colour(number - 1));
        if (!none) seen[number] = panel.pixels.back();
    }
    constexpr std::size_t most = 20;
    for (const auto& [number, shade] : seen) {
        if (panel.legend.size() == most) break;
        std::string name = fmt::format("{}", number);
        if (row.name == "body") {
            const auto index = static_cast<std::size_t>(number - 1);
            name += index < planes.bodies.size() ? " " + planes.bodies[index].substr(0, 24) : " Sun";
        }
        panel.legend.emplace_back(shade, name);
    }
}

} // namespace

std::vector<std::string> layer_choices() {
    std::vector<std::string> out;
    for (const LayerRow& row : rows)
        out.emplace_back(row.name);
    return out;
}

Panel layer_panel(std::string_view name, const LayerPlanes& planes) {
    const auto* const row =
        std::find_if(std::begin(rows), std::end(rows), [&](const LayerRow& r) { return r.name == name; });
    assert(row != std::end(rows));
    Panel panel{std::string(row->title), planes.width, planes.height, {}, {}, {}};
    if (row->shown == Shown::normal) {
        paint_normal(planes, panel);
        return panel;
    }
    if (row->shown == Shown::classes) {
        paint_classes(*row, planes, panel);
        return panel;
    }
    const std::span<const float> from = plane(planes, row->plane);
    std::vector<double> values(from.begin(), from.end());
    ColourScale scale{ColourMap::viridis, 0, 1, "", {}};
    if (row->shown == Shown::error) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            const auto signal = static_cast<double>(planes.irradiance[i]);
            values[i] = values[i] > 0 && signal > 0 ? 100 * std::sqrt(values[i]) / signal
                                                    : std::numeric_limits<double>::quiet_NaN();
        }
        // Edges of bodies and shadows have errors many times those of the ground: logarithmic colours between
        // quantiles.
        std::vector<double> known;
        std::copy_if(values.begin(), values.end(), std::back_inserter(known),
                     [](double v) { return !std::isnan(v); });
        const auto quantile = [&](double part) {
            const auto at = known.begin() + static_cast<std::ptrdiff_t>(
                                                std::lround(part * static_cast<double>(known.size() - 1)));
            std::nth_element(known.begin(), at, known.end());
            return *at;
        };
        if (!known.empty()) scale.low = quantile(0.02), scale.high = quantile(0.99);
        if (scale.low > 0 && scale.high > scale.low)
            scale.position = [low = scale.low, high = scale.high](double v) {
                return v > low ? std::log(v / low) / std::log(high / low) : 0.0;
            };
        scale.label = "% of the pixel";
    } else {
        std::tie(scale.low, scale.high) = limits(values);
    }
    if (row->shown == Shown::lengths) {
        const bool kilometres = scale.high >= 1e4;
        scale.label = kilometres ? "km" : "m";
        if (kilometres) {
            scale.low /= 1000, scale.high /= 1000;
            for (double& v : values)
                v /= 1000;
        }
    }
    if (row->shown == Shown::angles) scale.label = "deg";
    if (row->shown == Shown::cyclic_angles) scale = {ColourMap::cyclic, -180, 180, "deg", {}};
    for (const double v : values)
        panel.pixels.push_back(scale.colour_of(v));
    panel.scale = std::move(scale);
    return panel;
}

} // namespace obscura::tools
