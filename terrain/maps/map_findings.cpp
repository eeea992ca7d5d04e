// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/map_findings.hpp"

#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

namespace obscura::terrain {
namespace {

/// Means of neighbouring numbers' differences over the spread of all: about 1.1 where neighbours have
/// nothing in common, near 0 on ground.
class Roughness {
public:
    void add_row() { last_ = std::numeric_limits<double>::quiet_NaN(); }
    void add(double value) {
        sum_ += value;
        squares_ += value * value;
        ++count_;
        if (!std::isnan(last_)) steps_ += std::abs(value - last_), ++step_count_;
        last_ = value;
    }
    [[nodiscard]] double value() const {
        if (count_ < 64 || step_count_ < 64) return 0;
        const auto n = static_cast<double>(count_);
        const double variance = squares_ / n - sum_ / n * (sum_ / n);
        return variance > 0 ? steps_ / static_cast<double>(step_count_) / std::sqrt(variance) : 0;
    }

private:
    double sum_ = 0, squares_ = 0, steps_ = 0;
    std::int64_t count_ = 0, step_count_ = 0;
    double last_ = std::numeric_limits<double>::quiet_NaN();
};

/// The roughness of the numbers as `read` makes them; no number: left out.
template<typename Read>
double roughness(std::span<const double> numbers, std::int64_t width, const Read& read) {
    constexpr std::size_t looked_at = 1 << 22;
    const auto columns = static_cast<std::size_t>(width);
    const std::size_t rows = numbers.size() / columns,
                      stride = std::max<std::size_t>(1, numbers.size() / looked_at);
    Roughness found;
    for (std::size_t row = 0; row < rows; row += stride) {
        found.add_row();
        for (const double number : numbers.subspan(row * columns, columns))
            if (const std::optional<double> value = read(number); value && std::isfinite(*value))
                found.add(*value);
    }
    return found.value();
}

/// How much smoother ground is than noise, and noise than ground is rough.
constexpr double noise = 0.5, smoother = 4;

bool is_swapped(double as_read, double swapped) {
    return as_read > noise && swapped > 0 && swapped * smoother < as_read;
}

/// Reals of 32 bits are compared by their logarithms, with sign: those of wrong bytes are spread over all
/// powers of ten.
std::optional<double> ordered(double value) {
    constexpr double least_exponent = -150;
    if (value == 0) return 0.0;
    return std::copysign(std::max(0.0, std::log2(std::abs(value)) - least_exponent), value);
}

double longitude_deg(const Projection& projection, double x_m) {
    return (projection.centre_longitude_rad + x_m / projection.turn_m() * 2 * std::numbers::pi) / degree;
}

/// The map's point at a place of the raster whose outer edges are at 0 and its width or height.
MapPoint at_edge(const MapFrame& frame, double column, double row) {
    const PixelTransform& t = frame.transform();
    return {t[0] + t[1] * column + t[2] * row, t[3] + t[4] * column + t[5] * row};
}

/// Last column and row of the transform.
std::array<double, 2> last_place(const MapFrame& frame) {
    const double less = frame.registration() == Registration::node ? 1 : 0;
    return {static_cast<double>(frame.width()) - less, static_cast<double>(frame.height()) - less};
}

} // namespace

std::string edges_text(const MapFrame& frame) {
    const auto [columns, rows] = last_place(frame);
    const Projection& projection = frame.projection();
    const MapPoint first = at_edge(frame, 0, 0), last = at_edge(frame, columns, rows);
    if (projection.kind == ProjectionKind::planar)
        return fmt::format("x {:.6g} to {:.6g} m, y {:.6g} to {:.6g} m", first.x_m, last.x_m, first.y_m,
                           last.y_m);
    if (projection.kind == ProjectionKind::simple_cylindrical) {
        const double latitude_per_m =
            360 / projection.turn_m() * std::cos(projection.true_scale_latitude_rad);
        return fmt::format("longitude {:.6g} to {:.6g} deg, latitude {:.6g} to {:.6g} deg",
                           longitude_deg(projection, first.x_m), longitude_deg(projection, last.x_m),
                           first.y_m * latitude_per_m, last.y_m * latitude_per_m);
    }
    // Along the edge, and the pole if it is inside.
    double least = 90, largest = -90;
    const auto add = [&](double column, double row) {
        const double latitude = projection.latitude_rad(frame.position({column, row})) / degree;
        least = std::min(least, latitude), largest = std::max(largest, latitude);
    };
    constexpr int points = 64;
    const double right = static_cast<double>(frame.width()) - 1,
                 bottom = static_cast<double>(frame.height()) - 1;
    for (int i = 0; i <= points; ++i)
        for (int j = 0; j <= points; ++j)
            add(right * i / points, bottom * j / points);
    return fmt::format("about the {} pole, latitude {:.6g} to {:.6g} deg",
                       projection.kind == ProjectionKind::north_polar_stereographic ? "north" : "south",
                       least, largest);
}

std::string swapped_bytes(std::span<const double> values, std::int64_t width, double scale, double offset) {
    std::vector<double> numbers(values.begin(), values.end());
    if (scale != 1 || offset != 0)
        for (double& v : numbers)
            v = std::round((v - offset) / scale * 1024) / 1024;
    bool integers = true, short_reals = true;
    double least = std::numeric_limits<double>::infinity(), largest = -least;
    for (const double v : numbers) {
        if (!std::isfinite(v)) continue;
        least = std::min(least, v), largest = std::max(largest, v);
        integers = integers && v == std::floor(v);
        short_reals = short_reals && static_cast<double>(static_cast<float>(v)) == v;
    }
    if (integers && least >= std::numeric_limits<std::int16_t>::min() &&
        largest <= std::numeric_limits<std::uint16_t>::max()) {
        const bool has_sign = least < 0;
        const auto swap = [has_sign](double v) -> std::optional<double> {
            const auto bits = static_cast<std::uint16_t>(static_cast<std::int32_t>(v));
            const auto other = static_cast<std::uint16_t>((bits << 8) | (bits >> 8));
            return has_sign ? static_cast<double>(static_cast<std::int16_t>(other))
                            : static_cast<double>(other);
        };
        // Signed heights that were read as unsigned are smooth only with their sign.
        const auto with_sign = [&](double v) -> std::optional<double> {
            const auto bits = static_cast<std::uint16_t>(static_cast<std::int32_t>(v));
            return static_cast<double>(
                static_cast<std::int16_t>(static_cast<std::uint16_t>((bits << 8) | (bits >> 8))));
        };
        const double as_read = roughness(numbers, width, [](double v) -> std::optional<double> { return v; });
        if (is_swapped(as_read, roughness(numbers, width, swap)) ||
            is_swapped(as_read, roughness(numbers, width, with_sign)))
            return "integers of 16 bits";
        return {};
    }
    if (!short_reals) return {};
    const double as_read = roughness(numbers, width, ordered);
    const double swapped = roughness(numbers, width, [](double v) {
        const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(v));
        const std::uint32_t other = bits << 24 | (bits & 0xff00u) << 8 | (bits >> 8 & 0xff00u) | bits >> 24;
        return ordered(static_cast<double>(std::bit_cast<float>(other)));
    });
    return is_swapped(as_read, swapped) ? "reals of 32 bits" : "";
}

std::string moved_from_label(const MapFrame& by_keys, const MapFrame& by_label) {
    constexpr auto cylindrical = ProjectionKind::simple_cylindrical;
    if (by_keys.projection().kind != cylindrical || by_label.projection().kind != cylindrical) return {};
    const Vec3 keys = by_keys.position({0, static_cast<double>(by_keys.height()) / 2});
    const Vec3 label = by_label.position({0, static_cast<double>(by_label.height()) / 2});
    const double apart =
        std::remainder(std::atan2(keys.y, keys.x) - std::atan2(label.y, label.x), 2 * std::numbers::pi);
    if (std::abs(apart) < 1 * degree) return {};
    return fmt::format(
        "the keys place it at {}, its label at {}: the keys hold. Leave out projection and the edges to take those of the label",
        edges_text(by_keys), edges_text(by_label));
}

bool fits_half_a_turn_away(const SurfaceDomain& domain, const HeightRaster& above,
                           const HeightRaster& below) {
    if (domain.is_plane()) return false;
    Raster::Reader upper(*above.raster), lower(*below.raster);
    const auto correlation = [&](double turn) {
        double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
        constexpr int points = 20'000;
        for (int k = 0; k < points; ++k) {
            const double z = 1 - (2 * k + 1.0) / points, rho = std::sqrt(1 - z * z);
            const double longitude = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
            const Vec3 p{rho * std::cos(longitude), rho * std::sin(longitude), z};
            const double x = upper.bilinear(p);
            if (std::isnan(x)) continue;
            const double y = lower.bilinear({turn * p.x, turn * p.y, p.z});
            if (std::isnan(y)) continue;
            ++n, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
        }
        constexpr double least_points = 50;
        const double spread = (n * aa - a * a) * (n * bb - b * b);
        return n >= least_points && spread > 0 ? (n * ab - a * b) / std::sqrt(spread) : 0;
    };
    constexpr double same = 0.7, other = 0.4;
    return correlation(1) < other && correlation(-1) > same;
}

std::string odd_relief(const HeightRaster& map, const SurfaceDomain& domain) {
    if (domain.is_plane() || !map.raster->whole()) return {};
    const SamplePyramid& samples = map.raster->samples();
    const double relief =
        map.scale_m * (static_cast<double>(samples.largest()) - static_cast<double>(samples.least()));
    const Vec3 radii = domain.radii_m();
    const double radius = std::min({radii.x, radii.y, radii.z});
    // Known solid bodies have from 0.0015 (Europa, Titan) up to that of asteroids.
    constexpr double flattest = 1e-4, round_body_m = 500'000, roughest_round = 0.1;
    if (relief > 0 && relief < flattest * radius)
        return fmt::format(
            "its highest and lowest place differ by {:.4g} m, on a body of radius {:.6g} m: are its numbers in kilometres? "
            "Try scale_m = 1000, or the scale that its documentation gives",
            relief, radius);
    if (radius > round_body_m && relief > roughest_round * radius)
        return fmt::format("its highest and lowest place differ by {:.4g} m, on a body of radius {:.6g} m: "
                           "give scale_m, the length of its unit, or values = \"radius\" with offset_m",
                           relief, radius);
    return {};
}

} // namespace obscura::terrain
