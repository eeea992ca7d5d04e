// SPDX-License-Identifier: Apache-2.0
// Texture look-up at one hit, over the footprint of a ray on the surface.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/textures/texture.hpp"
#include "renderer/textures/texture_place.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace obscura::renderer {

/// Texture and, where the file states one, its place on the body; null: by the body's texture coordinates.
struct PlacedTexture {
    std::shared_ptr<const Texture> texture; ///< null: none
    std::shared_ptr<const TexturePlace> place;

    explicit operator bool() const { return texture != nullptr; }
    /// Mean of a plane over the body, with `outside` where the map is not.
    [[nodiscard]] double mean(std::size_t plane, double outside) const {
        const double share = place ? place->share() : 1;
        return share * texture->mean(plane) + (1 - share) * outside;
    }
};

/// Footprint of a ray on the surface: the edges of a parallelogram, m.
inline void footprint(Vec3 direction, Vec3 normal, double width_m, Vec3& longer, Vec3& shorter) {
    const double cosine = std::max(std::abs(dot(direction, normal)), 0.01);
    const Vec3 side = cross(direction, normal);
    Vec3 across;
    Vec3 along;
    if (length_squared(side) > 1e-12) {
        across = normalized(side);
        along = cross(normal, across);
    } else {
        orthonormal_basis(normal, across, along);
    }
    longer = along * (width_m / cosine);
    shorter = across * width_m;
}

/// A step on the surface in texture coordinates.
inline TextureAxis texture_axis(Vec3 step_m, Vec3 grad_u, Vec3 grad_v) {
    return {dot(grad_u, step_m), dot(grad_v, step_m)};
}

/// Look-up at one lane, over a footprint.
struct TextureLookup {
    const UvPacket& at;
    int lane;
    Vec3 position, longer_m, shorter_m;

    /// False: outside the texture's map.
    bool sample(const PlacedTexture& texture, double* planes) const {
        if (const TexturePlace* const place = texture.place.get()) {
            double u = 0, v = 0;
            if (!place->coordinates(position, u, v)) return false;
            texture.texture->sample(u, v, place->axis(position, longer_m), place->axis(position, shorter_m),
                                    planes);
            return true;
        }
        texture.texture->sample(at.u[lane], at.v[lane], longer(), shorter(), planes);
        return true;
    }
    /// Edges of the footprint in the body's texture coordinates.
    [[nodiscard]] TextureAxis longer() const {
        return texture_axis(longer_m, at.grad_u.lane(lane), at.grad_v.lane(lane));
    }
    [[nodiscard]] TextureAxis shorter() const {
        return texture_axis(shorter_m, at.grad_u.lane(lane), at.grad_v.lane(lane));
    }
    void gradients(const PlacedTexture& texture, Vec3& grad_u, Vec3& grad_v) const {
        if (texture.place) return texture.place->gradients(position, grad_u, grad_v);
        grad_u = at.grad_u.lane(lane);
        grad_v = at.grad_v.lane(lane);
    }
};

} // namespace obscura::renderer
