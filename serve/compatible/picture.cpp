// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/picture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace obscura::serve::compatible {
namespace {

static_assert(std::endian::native == std::endian::little);

/// Calls `value(pixel, out)` for all pixels, bottom row first; `out` is where its `count` numbers go.
template<typename Number, typename Value>
std::string rows_from_below(const Picture& picture, std::size_t count, const Value& value) {
    const auto width = static_cast<std::size_t>(picture.width);
    const auto height = static_cast<std::size_t>(picture.height);
    std::string data(picture.pixels() * count * sizeof(Number), '\0');
    auto* out = reinterpret_cast<Number*>(data.data());
    for (std::size_t row = height; row-- > 0;)
        for (std::size_t column = 0; column < width; ++column, out += count)
            value(row * width + column, out);
    return data;
}

std::uint8_t to_byte(double value) {
    // NaN becomes 0.
    return value > 0 ? static_cast<std::uint8_t>(std::lround(std::min(value, 1.0) * 255)) : 0;
}

double mean_of_three(const Picture& picture, std::size_t pixel) {
    const std::size_t plane = picture.pixels();
    const float* const at = picture.values.data() + pixel;
    return (static_cast<double>(at[0]) + static_cast<double>(at[plane]) +
            static_cast<double>(at[2 * plane])) /
           3;
}

void put(Vec3 v, bool backward, float* out) {
    out[0] = static_cast<float>(v.x);
    out[1] = static_cast<float>(backward ? -v.y : v.y);
    out[2] = static_cast<float>(backward ? -v.z : v.z);
}

using Packet = std::array<double, models::Program::lane_step>;
constexpr std::int32_t unit_pixels = 1024;
constexpr double unit_pitch_m = 6.0 / unit_pixels, unit_centre = (unit_pixels - 1) / 2.0;

} // namespace

models::SensorPlane unit_plane() {
    models::SensorPlane plane;
    plane.focal_length_m = 1;
    plane.width = plane.height = unit_pixels;
    plane.column_m = {unit_pitch_m, 0};
    plane.row_m = {0, unit_pitch_m};
    plane.first_m = {-unit_centre * unit_pitch_m, -unit_centre * unit_pitch_m};
    return plane;
}

double PictureLens::radius(double angle_rad, bool down) const {
    using scene::Projection;
    switch (projection) {
    case Projection::pinhole:
        return std::tan(angle_rad);
    case Projection::equidistant:
        return angle_rad;
    case Projection::equisolid:
        return 2 * std::sin(angle_rad / 2);
    case Projection::stereographic:
        return 2 * std::tan(angle_rad / 2);
    case Projection::orthographic:
        return std::sin(angle_rad);
    case Projection::model: {
        Packet x, y, across, none{}, along;
        across.fill(std::sin(angle_rad));
        along.fill(std::cos(angle_rad));
        unit->project_any(
            {down ? none.data() : across.data(), down ? across.data() : none.data(), along.data()}, x.data(),
            y.data(), x.size());
        return std::hypot(x[0] - unit_centre, y[0] - unit_centre) * unit_pitch_m;
    }
    }
    return 0;
}

double PictureLens::max_angle_rad() const {
    using scene::Projection;
    const bool half = projection == Projection::pinhole || projection == Projection::orthographic;
    return half ? std::numbers::pi / 2 : std::numbers::pi;
}

Vec3 PictureLens::direction(double x, double y) const {
    using scene::Projection;
    const auto& [k1, k2, k3, p1, p2] = distortion;
    const double r2 = x * x + y * y, radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    const double u = x + x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y;
    const double v = y + y * radial + 2 * p1 * x * y + p2 * (r2 + 2 * y * y);
    const double r = std::hypot(u, v);
    double angle_rad = 0;
    switch (projection) {
    case Projection::pinhole:
        return normalized(Vec3{u, v, 1});
    case Projection::equidistant:
        angle_rad = r;
        break;
    case Projection::equisolid:
        angle_rad = r <= 2 ? 2 * std::asin(r / 2) : 4;
        break;
    case Projection::stereographic:
        angle_rad = 2 * std::atan(r / 2);
        break;
    case Projection::orthographic:
        angle_rad = r <= 1 ? std::asin(r) : 4;
        break;
    case Projection::model: {
        Packet column, row, solid_angle, dx, dy, dz;
        column.fill(x / unit_pitch_m + unit_centre);
        row.fill(y / unit_pitch_m + unit_centre);
        unit->rays(column.data(), row.data(), {dx.data(), dy.data(), dz.data()}, solid_angle.data(),
                   column.size());
        return solid_angle[0] != 0 ? Vec3{dx[0], dy[0], dz[0]} : Vec3{};
    }
    }
    if (angle_rad > max_angle_rad()) return {};
    const double across = r > 0 ? std::sin(angle_rad) / r : 0;
    return {u * across, v * across, std::cos(angle_rad)};
}

Vec3 Picture::ray(std::int32_t column, std::int32_t row) const {
    if (scanned) return lens.direction(0, 0);
    return lens.direction((column + 0.5 - width / 2.0) / fx_px, (row + 0.5 - height / 2.0) / fy_px);
}

std::string as_float(const Picture& picture) {
    const std::size_t plane = picture.pixels();
    return rows_from_below<float>(picture, 4, [&](std::size_t pixel, float* out) {
        for (std::size_t c = 0; c < 4; ++c)
            out[c] = picture.values[c * plane + pixel];
    });
}

std::string as_bytes(const Picture& picture) {
    const std::size_t plane = picture.pixels();
    return rows_from_below<std::uint8_t>(picture, 4, [&](std::size_t pixel, std::uint8_t* out) {
        for (std::size_t c = 0; c < 4; ++c)
            out[c] = to_byte(static_cast<double>(picture.values[c * plane + pixel]));
    });
}

std::string gray_float(const Picture& picture) {
    return rows_from_below<float>(picture, 1, [&](std::size_t pixel, float* out) {
        *out = static_cast<float>(mean_of_three(picture, pixel));
    });
}

std::string gray_bytes(const Picture& picture) {
    return rows_from_below<std::uint8_t>(picture, 1, [&](std::size_t pixel, std::uint8_t* out) {
        *out = to_byte(mean_of_three(picture, pixel));
    });
}

std::string weighted_float(const Picture& picture, const std::array<double, 4>& weights) {
    const std::size_t plane = picture.pixels();
    return rows_from_below<float>(picture, 1, [&](std::size_t pixel, float* out) {
        double sum = 0;
        for (std::size_t c = 0; c < 4; ++c)
            sum += weights[c] * static_cast<double>(picture.values[c * plane + pixel]);
        *out = static_cast<float>(sum);
    });
}

std::string depth_map(const Picture& picture) {
    return rows_from_below<double>(picture, 1,
                                   [&](std::size_t pixel, double* out) { *out = picture.range_m[pixel]; });
}

std::string normal_map(const Picture& picture, bool backward) {
    const Mat3 to_camera = transposed(to_matrix(picture.eye.orientation));
    return rows_from_below<float>(picture, 3, [&](std::size_t pixel, float* out) {
        const auto component = [&](std::size_t k) { return static_cast<double>(picture.normal[k][pixel]); };
        if (std::isnan(component(0))) return; // nothing there: 0, 0, 0
        put(to_camera * Vec3{component(0), component(1), component(2)}, backward, out);
    });
}

std::string los_map(const Picture& picture, bool backward) {
    const auto width = static_cast<std::size_t>(picture.width);
    return rows_from_below<float>(picture, 3, [&](std::size_t pixel, float* out) {
        put(picture.ray(static_cast<std::int32_t>(pixel % width), static_cast<std::int32_t>(pixel / width)),
            backward, out);
    });
}

std::string time_map(const Picture& picture) {
    const auto width = static_cast<std::size_t>(picture.width);
    return rows_from_below<float>(picture, 1, [&](std::size_t pixel, float* out) {
        if (!picture.times.empty()) {
            *out = static_cast<float>(to_seconds(picture.times[pixel].mid().ns));
            return;
        }
        const double from_middle = static_cast<double>(pixel / width) - (picture.height - 1) / 2.0;
        *out = static_cast<float>(picture.mid_s + picture.line_s * from_middle);
    });
}

std::string byte_planes(const std::string& floats) {
    const std::size_t count = floats.size() / sizeof(float);
    std::string planes(floats.size(), '\0');
    for (std::size_t i = 0; i < floats.size(); ++i)
        planes[i % sizeof(float) * count + i / sizeof(float)] = floats[i];
    return planes;
}

} // namespace obscura::serve::compatible
