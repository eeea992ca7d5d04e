// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/height_map.hpp"

#include "core/error.hpp"
#include "core/memory_budget.hpp"
#include "images/image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Weights of four samples at -1, 0, 1, 2 for the place `t`, 0 to 1.
std::array<double, 4> catmull_rom(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1, -1.5 * t3 + 2 * t2 + 0.5 * t,
            0.5 * t3 - 0.5 * t2};
}

} // namespace

HeightMap::HeightMap(std::int32_t width, std::int32_t height, std::vector<float> samples,
                     double left_longitude_rad)
    : width_(width), height_(height), left_longitude_rad_(left_longitude_rad), samples_(std::move(samples)) {
    const auto [least, largest] = std::minmax_element(samples_.begin(), samples_.end());
    least_ = *least;
    largest_ = *largest;
}

double HeightMap::at(Vec3 p) const {
    const double longitude = std::atan2(p.y, p.x);
    const double latitude = std::atan2(p.z, std::hypot(p.x, p.y));
    const double turns = (longitude - left_longitude_rad_) / (2 * std::numbers::pi);
    const double x = (turns - std::floor(turns)) * width_ - 0.5;
    const double y = (0.5 - latitude / std::numbers::pi) * height_ - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const std::array<double, 4> across = catmull_rom(x - left), down = catmull_rom(y - top);
    double sum = 0;
    for (std::int32_t j = 0; j < 4; ++j) {
        std::int32_t row = static_cast<std::int32_t>(top) - 1 + j;
        std::int32_t shift = 0;
        if (row < 0 || row >= height_) { // over the pole
            row = row < 0 ? -1 - row : 2 * height_ - 1 - row;
            shift = width_ / 2;
        }
        row = std::clamp(row, 0, height_ - 1);
        const float* const line =
            samples_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
        double line_sum = 0;
        for (std::int32_t i = 0; i < 4; ++i) {
            const std::int32_t column =
                (static_cast<std::int32_t>(left) - 1 + i + shift + 2 * width_) % width_;
            line_sum += across[static_cast<std::size_t>(i)] * static_cast<double>(line[column]);
        }
        sum += down[static_cast<std::size_t>(j)] * line_sum;
    }
    return sum;
}

HeightMap read_height_map(const std::filesystem::path& file, double metres_per_unit,
                          double left_longitude_rad) {
    images::Image image = images::read_image(file);
    const std::int64_t pixels = std::int64_t{image.width} * image.height;
    if (pixels > max_height_map_pixels)
        throw InputError(fmt::format("{}: {} x {} pixels; a height map has at most {} million", file.string(),
                                     image.width, image.height, max_height_map_pixels / 1'000'000));
    if (image.width != 2 * image.height || image.height < 4)
        throw InputError(
            fmt::format("{}: {} x {} pixels; a height map covers the whole body by longitude and "
                        "latitude and is twice as wide as high, at least 8 x 4",
                        file.string(), image.width, image.height));
    require_memory(static_cast<std::uint64_t>(pixels) * sizeof(float), file.string());
    std::vector<float> samples(static_cast<std::size_t>(pixels));
    for (std::size_t i = 0; i < samples.size(); ++i) {
        samples[i] = static_cast<float>(image.values[i] * metres_per_unit);
        if (!std::isfinite(samples[i]))
            throw InputError(fmt::format("{}: pixel {}, {} has no height; a height map has no holes",
                                         file.string(), i % static_cast<std::size_t>(image.width),
                                         i / static_cast<std::size_t>(image.width)));
    }
    return {image.width, image.height, std::move(samples), left_longitude_rad};
}

} // namespace obscura::renderer
