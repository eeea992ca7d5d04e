// SPDX-License-Identifier: Apache-2.0
// Maker of the surface textures of the bodies of a scene.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/textures/surface_textures.hpp"
#include "renderer/world/albedo_maker.hpp"
#include "renderer/world/own_light.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// Makes the surface textures of bodies; those that name the same file share one texture. Thread-bound. Keeps
/// references to bands and globals.
class SurfaceTexturesMaker {
public:
    SurfaceTexturesMaker(const std::vector<SpectralBand>& bands, const std::vector<models::Global>& globals)
        : bands_(bands), globals_(globals), albedos_(bands) {}

    /// Null where nothing varies over the body. Sets the textured parameters of `material` to their means.
    /// Throws ConfigError or InputError.
    std::shared_ptr<const SurfaceTextures> make(const scene::Body& body, const Shape& shape,
                                                const OwnLight& light, scene::Material& material);

private:
    /// How and where the textures of one body are read.
    struct Reading {
        TextureMapping mapping;
        TextureCoding coding;
        std::string place;   ///< "body 'NAME'"
        double radius_m = 1; ///< of the body, about
    };
    /// What a texture that a user has written is for.
    enum class Use : std::uint8_t { bands, parameter, channels };

    void note_places(const scene::Textures& given, TextureMapping mapping, SurfaceTextures& textures);
    std::vector<ModelImage> images_of(const scene::Body& body, scene::Material& material,
                                      const Reading& reading);
    std::shared_ptr<const ModelSurface> model_surface(const scene::Body& body, scene::Material& material,
                                                      const Reading& reading);
    std::shared_ptr<const ProceduralTexture> procedural(const scene::ModelTexture& given, Use use,
                                                        const Reading& reading);
    /// Says what is odd about values of a texture for `what`. Throws ConfigError if they cannot be used.
    ProceduralTexture::Range checked_range(const ProceduralTexture& texture, std::string_view what,
                                           const Reading& reading, SurfaceTextures* notes);
    void set_maps(const scene::Body& body, const Reading& reading, scene::Material& material,
                  SurfaceTextures& textures);
    SurfaceTextures::Slot slot_of(const std::filesystem::path& file, const MeshMaterial& m, bool own_uv,
                                  const Reading& reading);
    PlacedTexture colours(const std::filesystem::path& file, TextureCoding coding, const Reading& reading);
    PlacedTexture normal(const std::filesystem::path& file, const Reading& reading);

    const std::vector<SpectralBand>& bands_;
    const std::vector<models::Global>& globals_;
    TextureCache cache_;
    AlbedoMaker albedos_;
};

} // namespace obscura::renderer
