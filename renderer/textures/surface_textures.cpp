// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/surface_textures.hpp"

#include "renderer/textures/band_weights.hpp"
#include "renderer/textures/nested_albedo.hpp"
#include "renderer/textures/paged_texture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
PlacedTexture TextureCache::get(const std::filesystem::path& file, TextureCoding coding,
                                TextureMapping mapping) {
    PlacedTexture& placed = textures_[{file, coding, mapping}];
    if (placed) return placed;
    placed.texture = std::make_shared<const Texture>(
        read_texture(file, coding, [&](std::int64_t width, std::int64_t height) {
            if (mapping == TextureMapping::own) return Texture::Edge::repeat;
            placed.place = read_texture_place(file, width, height, mapping == TextureMapping::plane);
            return placed.place ? placed.place->edge() : Texture::Edge::clamp;
        }));
    return placed;
}

const TexturePlace* TextureCache::place(const std::filesystem::path& file, TextureMapping mapping) const {
    for (const TextureCoding coding : {TextureCoding::linear, TextureCoding::srgb})
        if (const auto found = textures_.find({file, coding, mapping}); found != textures_.end())
            return found->second.place.get();
    return nullptr;
}

SurfaceTextures::SurfaceTextures(std::vector<Slot> slots, const std::vector<SpectralBand>& bands, bool latlon,
                                 double left_longitude_rad)
    : spectral_bands_(bands),
      slots_(std::move(slots)),
      weights_(slots_.size()),
      latlon_(latlon),
      left_turns_(left_longitude_rad / (2 * std::numbers::pi)) {
    double sum = 0;
    for (std::size_t p = 0; p < slots_.size(); ++p) {
        const Slot& slot = slots_[p];
        double value = slot.factor.empty() ? 1 : slot.factor[0];
        for (const double f : slot.factor)
            grey_ = grey_ && f == slot.factor[0];
        if (slot.albedo) {
            const std::size_t planes = slot.albedo.texture->planes();
            std::vector<double>& w = weights_[p];
            w = band_weights(*slot.albedo.texture, bands);
            grey_ = grey_ && same_in_all_bands(w, planes);
            double mean = 0;
            for (std::size_t k = 0; k < planes; ++k)
                mean += w[k] * slot.albedo.mean(k, 1);
            value *= mean;
        }
        sum += value;
    }
    mean_factor_ = sum / static_cast<double>(slots_.size());
}

void SurfaceTextures::set_maps(std::vector<Map> maps, std::vector<double> constants) {
    maps_ = std::move(maps);
    constants_ = std::move(constants);
}

void SurfaceTextures::set_nested(std::shared_ptr<const NestedAlbedo> nested) {
    nested_ = std::move(nested);
    grey_ = grey_ && nested_->grey();
    mean_factor_ *= nested_->mean();
}

std::vector<std::string> SurfaceTextures::notes() const {
    std::vector<std::string> lines = notes_;
    if (nested_) lines.insert(lines.end(), nested_->notes().begin(), nested_->notes().end());
    return lines;
}

void SurfaceTextures::set_emission(PlacedTexture texture) {
    emission_ = std::move(texture);
    emission_weights_ = band_weights(*emission_.texture, spectral_bands_);
}

template<typename Use>
void SurfaceTextures::for_each_paged(const Use& use) const {
    const auto each = [&](const std::shared_ptr<const Texture>& texture) {
        if (texture && texture->paged() != nullptr) use(*texture->paged());
    };
    for (const Slot& slot : slots_) {
        each(slot.albedo.texture);
        each(slot.normal.texture);
    }
    for (const Map& map : maps_)
        each(map.texture.texture);
    each(emission_.texture);
    const auto each_of = [&](const std::shared_ptr<const ProceduralTexture>& model) {
        if (model)
            for (const ProceduralTexture::Image& image : model->images())
                each(image.texture);
    };
    each_of(albedo_model_);
    each_of(emission_model_);
    for (const Map& map : maps_)
        each_of(map.model);
    for (const auto& model : {model_, model_emission_})
        for (std::size_t k = 0; model && k < model->images().size(); ++k) {
            each(model->images()[k].texture.texture);
            each_of(model->images()[k].model);
        }
    if (nested_)
        for (const auto& texture : nested_->textures())
            each(texture);
}

void SurfaceTextures::stop_waiting() const {
    for_each_paged([](PagedTexture& paged) { paged.set_waiting(false); });
}

std::uint64_t SurfaceTextures::missed_tiles() const {
    std::uint64_t missed = 0;
    for_each_paged([&](const PagedTexture& paged) { missed += paged.coarser_lookups(); });
    return missed;
}

void SurfaceTextures::texture_coordinates(const Shape& shape, const HitPacket& hits, std::int32_t body,
                                          const SurfacePacket& surface, UvPacket& out) const {
    if (!latlon_ && shape.texture_coordinates(hits, body, surface, out)) return;
    uv_by_longitude(surface, left_turns_, out);
}

void SurfaceTextures::apply(const Shape& shape, const RayPacket& view, const HitPacket& hits,
                            std::int32_t body, const Doubles& width_m, std::size_t channels,
                            const SampleTimes& time, SurfacePacket& surface, Channels& factor,
                            ParameterPacket& varied) const {
    bool has_uv = false;
    UvPacket at;
    for (std::size_t k = 0; varies() && k < constants_.size(); ++k)
        for (int i = 0; i < packet_size; ++i)
            varied.value[k][i] = constants_[k];
    for (std::size_t c = 0; c < channels; ++c)
        std::fill_n(factor.v[c].v, packet_size, 1.0);
    if (has_models()) {
        texture_coordinates(shape, hits, body, surface, at);
        has_uv = true;
        apply_models(view, hits, body, at, width_m, channels, time, surface, factor, varied);
    }
    for (int i = 0; i < packet_size; ++i) {
        if (hits.body[i] != body) continue;
        const std::size_t number = slot_of(shape, hits.primitive[i]);
        const Slot& slot = slots_[number];
        if (!slot.factor.empty())
            for (std::size_t c = 0; c < channels; ++c)
                factor.v[c][i] *= slot.factor[c];
        if (!slot.albedo && !slot.normal && maps_.empty() && !nested_) continue;
        Vec3 longer_m, shorter_m;
        footprint(view.direction.lane(i), surface.facet_normal.lane(i), width_m[i], longer_m, shorter_m);
        if (nested_) {
            double own[max_channels];
            nested_->factors(surface.position.lane(i), longer_m, shorter_m, channels, own);
            for (std::size_t c = 0; c < channels; ++c)
                factor.v[c][i] *= own[c];
        }
        if (!slot.albedo && !slot.normal && maps_.empty()) continue;
        if (!has_uv) {
            texture_coordinates(shape, hits, body, surface, at);
            has_uv = true;
        }
        const TextureLookup lookup{at, i, surface.position.lane(i), longer_m, shorter_m};
        double planes[Texture::max_planes];
        if (slot.albedo && lookup.sample(slot.albedo, planes)) {
            const std::size_t count = slot.albedo.texture->planes();
            for (std::size_t c = 0; c < channels; ++c)
                factor.v[c][i] *= band_value(weights_[number], c, planes, count);
        }
        for (const Map& map : maps_)
            if (map.texture && lookup.sample(map.texture, planes))
                varied.value[map.parameter][i] = map.at_zero + map.gain * planes[0];
        if (slot.normal && lookup.sample(slot.normal, planes)) {
            Vec3 grad_u, grad_v;
            lookup.gradients(slot.normal, grad_u, grad_v);
            const Vec3 n = surface.normal.lane(i);
            const Vec3 right = grad_u - n * dot(n, grad_u);
            const Vec3 down = grad_v - n * dot(n, grad_v);
            if (!(length_squared(right) > 0)) continue;
            const Vec3 x = normalized(right);
            Vec3 y = cross(n, x);
            if (dot(y, down) > 0) y = -y;
            const Vec3 turned = x * (2 * planes[0] - 1) + y * (2 * planes[1] - 1) + n * (2 * planes[2] - 1);
            const double norm = length(turned);
            if (norm > 1e-6) surface.normal.set(i, turned / norm);
        }
    }
}

bool SurfaceTextures::has_models() const {
    return model_ || albedo_model_ ||
           std::any_of(maps_.begin(), maps_.end(), [](const Map& map) { return map.model != nullptr; });
}

void SurfaceTextures::set_albedo_model(std::shared_ptr<const ProceduralTexture> texture, double mean) {
    albedo_model_ = std::move(texture);
    grey_ = grey_ && albedo_model_->grey();
    mean_factor_ *= mean;
}

void SurfaceTextures::apply_models(const RayPacket& view, const HitPacket& hits, std::int32_t body,
                                   const UvPacket& at, const Doubles& width_m, std::size_t channels,
                                   const SampleTimes& time, const SurfacePacket& surface, Channels& factor,
                                   ParameterPacket& varied) const {
    Lanes here{};
    for (int i = 0; i < packet_size; ++i)
        here.on[i] = hits.body[i] == body ? -1 : 0;
    const TexturePoints points = texture_points(here, at, surface, view.direction, width_m);
    Channels values;
    if (albedo_model_) {
        albedo_model_->sample(points, channels, values);
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i)
                if (here.on[i] != 0 && !std::isnan(values.v[c][i]))
                    factor.v[c][i] *= std::max(0.0, values.v[c][i]);
    }
    for (const Map& map : maps_) {
        if (!map.model) continue;
        map.model->sample(points, 1, values);
        for (int i = 0; i < packet_size; ++i)
            if (here.on[i] != 0 && std::isfinite(values.v[0][i]))
                varied.value[map.parameter][i] = map.at_zero + map.gain * values.v[0][i];
    }
    if (model_) model_->fill(points, at, time, varied);
}

void SurfaceTextures::run_emission(const TexturePoints& points, const RayPacket& view, const UvPacket& at,
                                   std::size_t channels, const SampleTimes& time,
                                   const SurfacePacket& surface, Channels& factor) const {
    const models::MaterialProgram& law = model_emission_->law();
    ParameterPacket rows;
    Doubles cos_out;
    for (int i = 0; i < packet_size; ++i) {
        const double cosine = -dot(surface.normal.lane(i), view.direction.lane(i));
        cos_out[i] = cosine > 1e-9 ? cosine : 1e-9;
    }
    for (std::size_t k = law.first_emission_row(); k < law.first_read_row(); ++k) {
        const std::size_t c = k - law.first_emission_row();
        for (int i = 0; i < packet_size; ++i)
            rows.value[k][i] = own_emission_.empty() ? 0 : own_emission_[c] * factor.v[c][i];
    }
    model_emission_->fill(points, at, time, rows);
    std::array<const double*, max_rows> starts{};
    for (std::size_t k = 0; k < law.rows(); ++k)
        starts[k] = rows.value[k].v;
    std::array<double*, max_channels> out{};
    for (std::size_t c = 0; c < law.outputs(); ++c)
        out[c] = factor.v[c].v;
    law.evaluate(cos_out.v, cos_out.v, cos_out.v, starts.data(), out.data(), packet_size);
    for (std::size_t c = 0; c < channels; ++c) {
        if (c >= law.outputs()) factor.v[c] = factor.v[0];
        for (int i = 0; i < packet_size; ++i)
            factor.v[c][i] = factor.v[c][i] > 0 && factor.v[c][i] < 1e15 ? factor.v[c][i] : 0.0;
    }
}

void SurfaceTextures::emission(const Shape& shape, const RayPacket& view, const HitPacket& hits,
                               std::int32_t body, const Doubles& width_m, std::size_t channels,
                               const SampleTimes& time, const SurfacePacket& surface,
                               Channels& factor) const {
    UvPacket at;
    texture_coordinates(shape, hits, body, surface, at);
    Lanes here{};
    for (int i = 0; i < packet_size; ++i) {
        for (std::size_t c = 0; c < channels; ++c)
            factor.v[c][i] = 1;
        if (hits.body[i] != body) continue;
        here.on[i] = -1;
        if (!emission_) continue;
        // As seen along the normal. Stretched by the slant, as for reflectances, footprints near a limb would
        // reach across the body, and those of its whole rim would gather the light of a few bright spots.
        Vec3 a, b;
        footprint(-surface.facet_normal.lane(i), surface.facet_normal.lane(i), width_m[i], a, b);
        double planes[Texture::max_planes];
        const TextureLookup lookup{at, i, surface.position.lane(i), a, b};
        if (!lookup.sample(emission_, planes)) continue;
        for (std::size_t c = 0; c < channels; ++c)
            factor.v[c][i] = band_value(emission_weights_, c, planes, emission_.texture->planes());
    }
    if (!emission_model_ && !model_emission_) return;
    // As seen along the normal, as above.
    Vec3s inwards;
    for (int i = 0; i < packet_size; ++i)
        inwards.set(i, -surface.facet_normal.lane(i));
    const TexturePoints points = texture_points(here, at, surface, inwards, width_m);
    if (emission_model_) {
        Channels values;
        emission_model_->sample(points, channels, values);
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i)
                if (here.on[i] != 0 && !std::isnan(values.v[c][i]))
                    factor.v[c][i] = std::max(0.0, values.v[c][i]);
    }
    if (model_emission_) run_emission(points, view, at, channels, time, surface, factor);
}

void uv_by_longitude(const SurfacePacket& surface, double left_turns, UvPacket& out) {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 p = surface.position.lane(i);
        const double r2 = length_squared(p);
        const double across2 = std::max(p.x * p.x + p.y * p.y, 1e-18 * r2);
        const double across = std::sqrt(across2);
        if (!(r2 > 0)) {
            out.u[i] = out.v[i] = 0.5;
            out.grad_u.set(i, {});
            out.grad_v.set(i, {});
            continue;
        }
        out.u[i] = std::atan2(p.y, p.x) / (2 * std::numbers::pi) - left_turns;
        out.v[i] = 0.5 - std::atan2(p.z, across) / std::numbers::pi;
        out.grad_u.set(i, Vec3{-p.y, p.x, 0} / (2 * std::numbers::pi * across2));
        out.grad_v.set(i, Vec3{p.x * p.z / across, p.y * p.z / across, -across} / (std::numbers::pi * r2));
    }
}

} // namespace obscura::renderer
