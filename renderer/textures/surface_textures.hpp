// SPDX-License-Identifier: Apache-2.0
// Surface textures of a body: albedo, normal and parameter maps, and the colours of its mesh file's
// materials.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/textures/texture.hpp"

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace obscura::renderer {

/// Reads textures; bodies of the same file share one. Throws InputError.
class TextureShelf {
public:
    std::shared_ptr<const Texture> get(const std::filesystem::path& file, TextureCoding coding,
                                       Texture::Edge edge);

private:
    std::map<std::tuple<std::filesystem::path, TextureCoding, Texture::Edge>, std::shared_ptr<const Texture>>
        textures_;
};

/// Immutable; any thread may call any member.
///
/// A texture of one plane counts for all bands, one with as many planes as there are bands gives each its
/// own; red, green and blue, of textures as of the colours of a mesh file's materials, are taken for
/// reflectances at 650, 550 and 450 nm, and each band gets the value at its middle, linear between them, held
/// outside. Normal maps hold x, y, z in red, green and blue, -1 to 1 as 0 to full scale, x along growing u, y
/// towards the image's first row, z out of the surface.
class SurfaceTextures {
public:
    /// What one part of a body shows.
    struct Part {
        std::vector<double> factor; ///< per band; empty: 1
        std::shared_ptr<const Texture> albedo, normal;
    };
    /// One parameter of the body's law from an image of one plane: `at_zero` + texel * `gain`.
    struct Map {
        std::size_t parameter; ///< in the order of varying_parameters()
        std::shared_ptr<const Texture> texture;
        double at_zero, gain;
    };

    /// `parts`, at least one, in the order of Shape::part(). `latlon`: by the place's longitude and latitude
    /// even where the shape has coordinates of its own; the image's left edge is at `left_longitude_rad`, its
    /// first row at +90 degrees.
    SurfaceTextures(std::vector<Part> parts, const std::vector<SpectralBand>& bands, bool latlon,
                    double left_longitude_rad);
    /// Has `maps` give the parameters that differ from place to place; `constants` has the law's others.
    void set_maps(std::vector<Map> maps, std::vector<double> constants);

    /// Whether the law's parameters differ from place to place.
    [[nodiscard]] bool varies() const { return !maps_.empty(); }
    /// Whether all bands see the same.
    [[nodiscard]] bool grey() const { return grey_; }
    /// Mean factor over parts and textures, for the first band.
    [[nodiscard]] double typical() const { return typical_; }
    [[nodiscard]] std::size_t parts() const { return parts_.size(); }

    /// Fills `factor[0, channels)` with what the body's reflectance is multiplied by at the hits of `body`,
    /// seen by rays `width_m` wide there, and turns the normals of `surface` by the normal map. Other lanes
    /// get 1. Fills `varied` if the parameters differ: 16 lanes that the law can work with.
    void apply(const Shape& shape, const RayPacket& view, const HitPacket& hits, std::int32_t body,
               const Doubles& width_m, std::size_t channels, SurfacePacket& surface, Channels& factor,
               ParameterPacket& varied) const;
    /// The texture coordinates alone; false where the body has neither textures nor coordinates.
    bool chart(const Shape& shape, const HitPacket& hits, std::int32_t body, const SurfacePacket& surface,
               ChartPacket& out) const;

private:
    [[nodiscard]] std::size_t part_of(const Shape& shape, std::uint32_t primitive) const {
        return parts_.size() == 1 ? 0 : shape.part(primitive);
    }

    std::vector<Part> parts_;
    std::vector<std::vector<double>> weights_; ///< per part: band x plane, for the albedo texture
    std::vector<Map> maps_;
    std::vector<double> constants_;
    std::size_t bands_;
    bool latlon_, grey_ = true;
    double left_turns_;
    double typical_ = 1;
};

/// Longitude and latitude of the surface's places as coordinates in a map that covers the whole body.
void chart_by_longitude(const SurfacePacket& surface, double left_turns, ChartPacket& out);

} // namespace obscura::renderer
