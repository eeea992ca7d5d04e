// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/model_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::renderer {
namespace {

/// Footprints of less are points.
constexpr double min_level = -60;

/// Channel `c` of a texture of `count` planes: the last plane stands for those that are missing.
std::size_t plane_of(std::size_t c, std::size_t count) {
    return std::min(c, count - 1);
}

} // namespace

double level_of(TextureAxis longer, TextureAxis shorter) {
    const double area = std::abs(longer.u * shorter.v - longer.v * shorter.u);
    return area > 0 ? std::max(0.5 * std::log2(area), min_level) : min_level;
}

void read_scaled(const Texture& texture, double u, double v, TextureAxis longer, TextureAxis shorter,
                 double level, double* planes) {
    if (!std::isnan(level)) {
        const double size = 0.5 * std::log2(texture.width() * texture.height());
        const double own = level_of(longer, shorter);
        const double wanted = std::clamp(level - size, min_level, 40.0);
        if (own > min_level) {
            const double scale = std::exp2(wanted - own);
            longer = {longer.u * scale, longer.v * scale};
            shorter = {shorter.u * scale, shorter.v * scale};
        } else {
            const double side = std::exp2(wanted + size);
            longer = {side / texture.width(), 0};
            shorter = {0, side / texture.height()};
        }
    }
    texture.sample(u, v, longer, shorter, planes);
}

std::array<double, 4> mean_channels(const ModelImage& image) {
    std::array<double, 4> means{};
    for (std::size_t c = 0; c < 4; ++c)
        means[c] = image.at_zero +
                   image.gain * image.texture.texture->mean(plane_of(c, image.texture.texture->planes()));
    return means;
}

ModelSurface::ModelSurface(std::shared_ptr<const models::MaterialProgram> law, std::vector<ModelImage> images)
    : law_(std::move(law)), images_(std::move(images)) {}

void ModelSurface::fill(const Lanes& here, const UvPacket& at, const SurfacePacket& surface,
                        const Vec3s& longer_m, const Vec3s& shorter_m, const SampleTimes& time,
                        ParameterPacket& rows) const {
    using models::SurfaceRow;
    const auto row = [&](SurfaceRow which) -> Doubles& { return rows.value[law_->row(which)]; };
    for (int i = 0; i < packet_size; ++i) {
        const bool on = here.on[i] != 0;
        row(SurfaceRow::t)[i] = on ? time.t[i] : 0;
        row(SurfaceRow::duration)[i] = time.duration_s;
        row(SurfaceRow::u)[i] = on ? at.u[i] : 0;
        row(SurfaceRow::v)[i] = on ? at.v[i] : 0;
        const TextureLookup lookup{at, i, {}, longer_m.lane(i), shorter_m.lane(i)};
        row(SurfaceRow::lod_bias)[i] = on ? level_of(lookup.longer(), lookup.shorter()) : 0;
    }
    for (std::size_t k = 0; k < law_->reads().size(); ++k)
        read(k, here, at, surface, longer_m, shorter_m, rows);
}

void ModelSurface::read(std::size_t index, const Lanes& here, const UvPacket& at,
                        const SurfacePacket& surface, const Vec3s& longer_m, const Vec3s& shorter_m,
                        ParameterPacket& rows) const {
    const models::LookUp& wanted = law_->reads()[index];
    const ModelImage& image = images_[wanted.texture];
    const std::size_t planes = image.texture.texture->planes();
    constexpr int points = 3; // the hit, and the ends of both edges of its footprint
    std::array<Doubles, points * 3> place;
    if (!wanted.own_place) {
        // The footprint goes through the same expressions as its middle.
        constexpr std::size_t lanes = points * packet_size;
        std::array<std::array<Doubles, points>, max_rows> inputs;
        std::array<const double*, max_rows> starts{};
        const std::size_t known = law_->first_read_row() + 4 * index;
        for (std::size_t k = 0; k < known; ++k) {
            inputs[k].fill(rows.value[k]);
            starts[k] = inputs[k][0].v;
        }
        const std::size_t u = law_->row(models::SurfaceRow::u), v = law_->row(models::SurfaceRow::v);
        for (int i = 0; i < packet_size; ++i) {
            const TextureLookup lookup{at, i, {}, longer_m.lane(i), shorter_m.lane(i)};
            if (here.on[i] == 0) continue;
            inputs[u][1][i] += lookup.longer().u;
            inputs[v][1][i] += lookup.longer().v;
            inputs[u][2][i] += lookup.shorter().u;
            inputs[v][2][i] += lookup.shorter().v;
        }
        std::array<double*, 3> out{place[0].v, place[points].v, place[2 * points].v};
        law_->read_at(index, starts.data(), out.data(), lanes);
    }
    const std::size_t first = law_->first_read_row() + 4 * index;
    const Doubles& lod_bias = rows.value[law_->row(models::SurfaceRow::lod_bias)];
    for (int i = 0; i < packet_size; ++i) {
        for (std::size_t c = 0; c < 4; ++c)
            rows.value[first + c][i] = 0;
        if (here.on[i] == 0) continue;
        double texel[Texture::max_planes];
        if (wanted.own_place) {
            const TextureLookup lookup{at, i, surface.position.lane(i), longer_m.lane(i), shorter_m.lane(i)};
            if (!lookup.sample(image.texture, texel))
                for (std::size_t c = 0; c < 4; ++c)
                    texel[plane_of(c, planes)] = image.texture.texture->mean(plane_of(c, planes));
        } else {
            const double u = place[0][i], v = place[points][i], level = place[2 * points][i];
            const TextureAxis longer{place[1][i] - u, place[points + 1][i] - v};
            const TextureAxis shorter{place[2][i] - u, place[points + 2][i] - v};
            const Texture& texture = *image.texture.texture;
            // A place that is no number has no texel.
            const bool known = std::isfinite(u) && std::isfinite(v) && std::abs(u) < 1e9 && std::abs(v) < 1e9;
            const double size = 0.5 * std::log2(texture.width() * texture.height());
            const bool same_level = level == lod_bias[i];
            if (known)
                read_scaled(texture, u, v, longer, shorter,
                            same_level ? std::numeric_limits<double>::quiet_NaN() : level + size, texel);
            for (std::size_t k = 0; k < planes && !known; ++k)
                texel[k] = texture.mean(k);
        }
        for (std::size_t c = 0; c < 4; ++c)
            rows.value[first + c][i] = image.at_zero + image.gain * texel[plane_of(c, planes)];
    }
}

} // namespace obscura::renderer
