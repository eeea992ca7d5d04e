// SPDX-License-Identifier: Apache-2.0
// Place of a texture on a body by the georeference of its file.
#pragma once

#include "core/geometry.hpp"
#include "renderer/textures/texture.hpp"
#include "terrain/geometry/map_frame.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

namespace obscura::renderer {

/// Texture coordinates of a map of a body or of part of it, as [[body.height]] places it. Immutable;
/// thread-safe; all but the constructor real-time safe.
class TexturePlace {
public:
    explicit TexturePlace(const terrain::MapFrame& frame);

    /// Texture coordinates of the direction of `p` (body frame; planar maps: of its x and y). False, and
    /// nothing set: it is outside the map.
    bool coordinates(Vec3 p, double& u, double& v) const;
    /// Change of the texture coordinates by a small step, m, from a point `p` of the body.
    [[nodiscard]] TextureAxis axis(Vec3 p, Vec3 step_m) const;
    /// Gradients of u and v at `p`, 1/m.
    void gradients(Vec3 p, Vec3& grad_u, Vec3& grad_v) const;

    [[nodiscard]] bool planar() const { return frame_.projection().kind == terrain::ProjectionKind::planar; }
    /// Share of all directions that the map covers, by 4096 of them; of a planar map 1.
    [[nodiscard]] double share() const { return share_; }
    /// How its texture ends.
    [[nodiscard]] Texture::Edge edge() const {
        return frame_.period() > 0 ? Texture::Edge::clamp : Texture::Edge::clamp_both;
    }

private:
    terrain::MapFrame frame_;
    double least_x_, largest_x_, least_y_, largest_y_; ///< of places inside
    double share_ = 1;
};

/// The place that an image or giant texture of that size states (PDS3 label, GeoTIFF, .obt); null: none, or
/// `planar` and it is a map of a planet, or the other way round. Throws InputError if it is one that cannot
/// be used.
[[nodiscard]] std::shared_ptr<const TexturePlace>
read_texture_place(const std::filesystem::path& file, std::int64_t width, std::int64_t height, bool planar);

} // namespace obscura::renderer
