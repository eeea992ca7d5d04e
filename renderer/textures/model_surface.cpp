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
    if (image.model) {
        means.fill(image.at_zero + image.gain * image.model->range(1).mean);
        return means;
    }
    for (std::size_t c = 0; c < 4; ++c)
        means[c] = image.at_zero +
                   image.gain * image.texture.texture->mean(plane_of(c, image.texture.texture->planes()));
    return means;
}

TexturePoints texture_points(const Lanes& here, const UvPacket& at, const SurfacePacket& surface,
                             const Vec3s& direction, const Doubles& width_m) {
    TexturePoints points{};
    points.here = here;
    points.u = at.u;
    points.v = at.v;
    points.position = surface.position;
    for (int i = 0; i < packet_size; ++i) {
        if (here.on[i] == 0) continue;
        Vec3 longer_m, shorter_m;
        footprint(direction.lane(i), surface.facet_normal.lane(i), width_m[i], longer_m, shorter_m);
        points.longer_m.set(i, longer_m);
        points.shorter_m.set(i, shorter_m);
        const TextureLookup lookup{at, i, {}, longer_m, shorter_m};
        points.longer[i] = lookup.longer();
        points.shorter[i] = lookup.shorter();
    }
    return points;
}

ModelSurface::ModelSurface(std::shared_ptr<const models::MaterialProgram> law, std::vector<ModelImage> images)
    : law_(std::move(law)), images_(std::move(images)) {}

void ModelSurface::fill(const TexturePoints& points, const UvPacket& at, const SampleTimes& time,
                        ParameterPacket& rows) const {
    using models::SurfaceRow;
    const auto row = [&](SurfaceRow which) -> Doubles& { return rows.value[law_->row(which)]; };
    for (int i = 0; i < packet_size; ++i) {
        const bool on = points.here.on[i] != 0;
        row(SurfaceRow::t)[i] = on ? time.t[i] : 0;
        row(SurfaceRow::duration)[i] = time.duration_s;
        row(SurfaceRow::u)[i] = on ? points.u[i] : 0;
        row(SurfaceRow::v)[i] = on ? points.v[i] : 0;
        row(SurfaceRow::lod_bias)[i] = on ? level_of(points.longer[i], points.shorter[i]) : 0;
    }
    for (std::size_t k = 0; k < law_->reads().size(); ++k)
        read(k, points, at, rows);
}

namespace {

/// The hit, and the ends of both edges of its footprint.
constexpr int surface_points = 3;

/// Points of a read at a place that is computed, and the levels that it asks for.
struct ComputedPlaces {
    TexturePoints points;
    Doubles level; ///< of the whole texture; NaN: that of the footprint
};

void set_computed(const models::MaterialProgram& law, std::size_t index, const TexturePoints& points,
                  const ParameterPacket& rows, ComputedPlaces& out) {
    // The footprint goes through the same expressions as its middle.
    std::array<std::array<Doubles, surface_points>, max_rows> inputs;
    std::array<const double*, max_rows> starts{};
    for (std::size_t k = 0; k < law.first_read_row() + 4 * index; ++k) {
        inputs[k].fill(rows.value[k]);
        starts[k] = inputs[k][0].v;
    }
    const std::size_t u = law.row(models::SurfaceRow::u), v = law.row(models::SurfaceRow::v);
    for (int i = 0; i < packet_size; ++i) {
        if (points.here.on[i] == 0) continue;
        inputs[u][1][i] += points.longer[i].u;
        inputs[v][1][i] += points.longer[i].v;
        inputs[u][2][i] += points.shorter[i].u;
        inputs[v][2][i] += points.shorter[i].v;
    }
    std::array<std::array<Doubles, surface_points>, 3> place;
    const std::array<double*, 3> to_place{place[0][0].v, place[1][0].v, place[2][0].v};
    law.read_at(index, starts.data(), to_place.data(), surface_points * packet_size);
    out.points = points;
    const Doubles& lod_bias = rows.value[law.row(models::SurfaceRow::lod_bias)];
    for (int i = 0; i < packet_size; ++i) {
        if (points.here.on[i] == 0) continue;
        const double at_u = place[0][0][i], at_v = place[1][0][i];
        out.points.u[i] = at_u;
        out.points.v[i] = at_v;
        out.points.longer[i] = {place[0][1][i] - at_u, place[1][1][i] - at_v};
        out.points.shorter[i] = {place[0][2][i] - at_u, place[1][2][i] - at_v};
        // A place that is no number has no texel.
        const bool known =
            std::isfinite(at_u) && std::isfinite(at_v) && std::abs(at_u) < 1e9 && std::abs(at_v) < 1e9;
        if (!known) out.points.here.on[i] = 0;
        const double level = place[2][0][i];
        out.level[i] = level == lod_bias[i] ? std::numeric_limits<double>::quiet_NaN() : level;
    }
}

} // namespace

void ModelSurface::read(std::size_t index, const TexturePoints& points, const UvPacket& at,
                        ParameterPacket& rows) const {
    const models::LookUp& wanted = law_->reads()[index];
    const ModelImage& image = images_[wanted.texture];
    ComputedPlaces computed;
    if (!wanted.own_place) set_computed(*law_, index, points, rows, computed);
    const TexturePoints& places = wanted.own_place ? points : computed.points;
    Doubles* const out = &rows.value[law_->first_read_row() + 4 * index];
    if (image.model) {
        Channels channels;
        image.model->sample(places, 4, channels);
        for (std::size_t c = 0; c < 4; ++c)
            for (int i = 0; i < packet_size; ++i) {
                const double value = channels.v[c][i];
                out[c][i] = places.here.on[i] != 0 ? image.at_zero + image.gain * value : 0.0;
            }
        return;
    }
    const Texture& texture = *image.texture.texture;
    const std::size_t planes = texture.planes();
    const double size = 0.5 * std::log2(texture.width() * texture.height());
    for (int i = 0; i < packet_size; ++i) {
        double texel[Texture::max_planes];
        for (std::size_t k = 0; k < planes; ++k)
            texel[k] = texture.mean(k);
        if (places.here.on[i] != 0 && wanted.own_place) {
            const TextureLookup lookup{at, i, points.position.lane(i), points.longer_m.lane(i),
                                       points.shorter_m.lane(i)};
            (void)lookup.sample(image.texture, texel);
        } else if (places.here.on[i] != 0) {
            read_scaled(texture, places.u[i], places.v[i], places.longer[i], places.shorter[i],
                        computed.level[i] + size, texel);
        }
        for (std::size_t c = 0; c < 4; ++c)
            out[c][i] =
                points.here.on[i] != 0 ? image.at_zero + image.gain * texel[plane_of(c, planes)] : 0.0;
    }
}

} // namespace obscura::renderer
