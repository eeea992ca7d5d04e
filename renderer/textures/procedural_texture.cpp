// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/procedural_texture.hpp"

#include "core/units.hpp"
#include "renderer/textures/band_weights.hpp"
#include "renderer/textures/model_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace obscura::renderer {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
/// The hit, and the ends of both edges of its footprint.
constexpr int footprint_points = 3;
constexpr std::size_t footprint_lanes = footprint_points * packet_size;

/// Step of a coordinate that may have gone once around.
double without_turn(double step) {
    return std::abs(step) > 0.5 ? step - std::round(step) : step;
}

} // namespace

/// Rows of the program: the lanes of the hits, then those of the ends of their footprints.
struct ProceduralTexture::Rows {
    std::array<std::array<Doubles, footprint_points>, models::TextureProgram::max_rows> values;
    std::array<const double*, models::TextureProgram::max_rows> starts{};
};

ProceduralTexture::ProceduralTexture(std::shared_ptr<const models::TextureProgram> program,
                                     std::vector<Image> images)
    : program_(std::move(program)), images_(std::move(images)) {}

void ProceduralTexture::sample(const TexturePoints& points, std::size_t channels, Channels& out) const {
    using Program = models::TextureProgram;
    Rows rows;
    const std::array<double, 2> size = program_->size();
    const double level_of_size = 0.5 * std::log2(size[0] * size[1]);
    for (int i = 0; i < packet_size; ++i) {
        const bool on = points.here.on[i] != 0;
        const Vec3 p = on ? points.position.lane(i) : Vec3{1, 0, 0};
        const Vec3 a = on ? points.longer_m.lane(i) : Vec3{}, b = on ? points.shorter_m.lane(i) : Vec3{};
        const TextureAxis along = on ? points.longer[i] : TextureAxis{},
                          across = on ? points.shorter[i] : TextureAxis{};
        const std::array<Vec3, footprint_points> at{p, p + a, p + b};
        const double u = on ? points.u[i] : 0.5, v = on ? points.v[i] : 0.5;
        const std::array<TextureAxis, footprint_points> uv{
            TextureAxis{u, v}, {u + along.u, v + along.v}, {u + across.u, v + across.v}};
        const auto set = [&](std::size_t row, int k, double value) {
            rows.values[row][static_cast<std::size_t>(k)][i] = value;
        };
        for (int k = 0; k < footprint_points; ++k) {
            const auto n = static_cast<std::size_t>(k);
            set(Program::row_x, k, program_->by_position() ? at[n].x : uv[n].u);
            set(Program::row_y, k, program_->by_position() ? at[n].y : uv[n].v);
            set(Program::row_z, k, at[n].z);
            // Without a level of its own, what is read by positions is filtered over the footprint.
            set(Program::row_level, k,
                program_->by_position() ? no_number : level_of(along, across) + level_of_size);
            set(Program::row_sample_m, k, std::sqrt(length(a) * length(b)));
        }
    }
    for (std::size_t k = 0; k < program_->rows(); ++k)
        rows.starts[k] = rows.values[k][0].v;
    for (std::size_t k = 0; k < program_->reads().size(); ++k)
        read(k, points, rows);
    std::array<double*, max_channels> to_out{};
    for (std::size_t c = 0; c < program_->outputs(); ++c)
        to_out[c] = out.v[c].v;
    program_->evaluate(rows.starts.data(), to_out.data(), packet_size);
    for (std::size_t c = program_->outputs(); c < channels; ++c)
        out.v[c] = out.v[0];
}

void ProceduralTexture::read(std::size_t index, const TexturePoints& points, Rows& rows) const {
    const models::LookUp& wanted = program_->reads()[index];
    const Image& image = images_[wanted.texture];
    const std::size_t planes = image.texture->planes();
    std::array<std::array<Doubles, footprint_points>, 3> place;
    if (!wanted.own_place) {
        std::array<double*, 3> out{place[0][0].v, place[1][0].v, place[2][0].v};
        program_->read_at(index, rows.starts.data(), out.data(), footprint_lanes);
    }
    const std::size_t first = models::TextureProgram::first_read_row + 4 * index;
    const Doubles& own_level = rows.values[models::TextureProgram::row_level][0];
    for (int i = 0; i < packet_size; ++i) {
        double texel[Texture::max_planes] = {};
        bool known = points.here.on[i] != 0;
        if (known && wanted.own_place) {
            image.texture->sample(points.u[i], points.v[i], points.longer[i], points.shorter[i], texel);
        } else if (known) {
            const double u = place[0][0][i], v = place[1][0][i], level = place[2][0][i];
            const TextureAxis longer{without_turn(place[0][1][i] - u), without_turn(place[1][1][i] - v)};
            const TextureAxis shorter{without_turn(place[0][2][i] - u), without_turn(place[1][2][i] - v)};
            // A place that is no number has no texel.
            known = std::isfinite(u) && std::isfinite(v) && std::abs(u) < 1e9 && std::abs(v) < 1e9 &&
                    std::isfinite(longer.u + longer.v + shorter.u + shorter.v);
            if (known)
                read_scaled(*image.texture, u, v, longer, shorter, level == own_level[i] ? no_number : level,
                            texel);
        }
        for (std::size_t c = 0; c < 4; ++c) {
            double value = no_number;
            if (known && image.weights.empty())
                value = texel[std::min(c, planes - 1)];
            else if (known) {
                const std::size_t bands = image.weights.size() / planes;
                value = band_value(image.weights, std::min(4 * wanted.group + c, bands - 1), texel, planes);
            }
            for (int k = 0; k < footprint_points; ++k)
                rows.values[first + c][static_cast<std::size_t>(k)][i] = value;
        }
    }
}

ProceduralTexture::Range ProceduralTexture::range(double radius_m) const {
    constexpr int packets = 256, count = packets * packet_size;
    Range range;
    range.least = std::numeric_limits<double>::infinity();
    range.largest = -range.least;
    const auto place_text = [&](const TexturePoints& points, int i) {
        if (!program_->by_position()) return fmt::format("at uv {:.3f}, {:.3f}", points.u[i], points.v[i]);
        const Vec3 p = points.position.lane(i);
        return fmt::format("at longitude {:.0f}, latitude {:.0f} deg", std::atan2(p.y, p.x) / degree,
                           std::asin(p.z / length(p)) / degree);
    };
    int known = 0;
    for (int packet = 0; packet < packets; ++packet) {
        TexturePoints points{};
        for (int i = 0; i < packet_size; ++i) {
            // Even in the sphere's area and in both coordinates: a rank-1 lattice.
            const int n = packet * packet_size + i;
            const double s = (n + 0.5) / count, t = std::fmod(n * (std::numbers::phi - 1), 1.0);
            const double z = 1 - 2 * s, ring = std::sqrt(std::max(0.0, 1 - z * z));
            const double azimuth = 2 * std::numbers::pi * t;
            points.here.on[i] = -1;
            points.u[i] = t;
            points.v[i] = s;
            points.position.set(i, radius_m * Vec3{ring * std::cos(azimuth), ring * std::sin(azimuth), z});
            points.longer[i] = {1.0 / 64, 0};
            points.shorter[i] = {0, 1.0 / 64};
            points.longer_m.set(i, radius_m / 32 * Vec3{-std::sin(azimuth), std::cos(azimuth), 0});
            points.shorter_m.set(i,
                                 radius_m / 32 * Vec3{-z * std::cos(azimuth), -z * std::sin(azimuth), ring});
        }
        Channels out;
        sample(points, 1, out);
        for (int i = 0; i < packet_size; ++i) {
            const double value = out.v[0][i];
            if (std::isnan(value)) continue;
            if (std::isinf(value)) {
                if (range.infinite_share == 0) range.infinite_at = place_text(points, i);
                range.infinite_share += 1.0 / count;
                continue;
            }
            ++known;
            if (value < 0) range.negative_share += 1.0 / count;
            if (value < std::min(range.least, 0.0)) range.negative_at = place_text(points, i);
            if (value > range.largest) range.largest_at = place_text(points, i);
            range.least = std::min(range.least, value);
            range.largest = std::max(range.largest, value);
            range.mean += value;
        }
    }
    range.no_data_share = 1 - static_cast<double>(known) / count - range.infinite_share;
    if (known == 0) range.least = range.largest = 0;
    if (known == 0) return range;
    range.mean /= known;
    return range;
}

} // namespace obscura::renderer
