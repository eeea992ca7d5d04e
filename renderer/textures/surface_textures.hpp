// SPDX-License-Identifier: Apache-2.0
// Surface textures of a body: albedo, normal, parameter and emission maps, and the colours of its mesh file's
// materials.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/mesh_files/triangle_mesh.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/textures/model_surface.hpp"
#include "renderer/textures/texture.hpp"
#include "renderer/textures/texture_lookup.hpp"
#include "renderer/textures/texture_place.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace obscura::renderer {

class NestedAlbedo;

/// How the texture coordinates of a body come about.
enum class TextureMapping : std::uint8_t {
    own,       ///< the shape has them: images repeat
    longitude, ///< by longitude and latitude, or the file's georeference
    plane,     ///< of a terrain: the same, of planar maps
};

/// Reads textures, each file once: bodies that name the same file share its texture. Throws InputError.
class TextureCache {
public:
    PlacedTexture get(const std::filesystem::path& file, TextureCoding coding, TextureMapping mapping);
    /// The place of a file that was read with that mapping; null: it has none.
    [[nodiscard]] const TexturePlace* place(const std::filesystem::path& file, TextureMapping mapping) const;

private:
    std::map<std::tuple<std::filesystem::path, TextureCoding, TextureMapping>, PlacedTexture> textures_;
};

/// Albedo, normal, parameter and emission maps of one body. Immutable; thread-safe.
///
/// A texture of one plane applies to all spectral bands; one with as many planes as there are bands gives
/// each band its own. Red, green and blue, of textures and of the materials of a mesh file, are taken for
/// reflectances at 650, 550 and 450 nm: each band gets the value at its middle wavelength, linear between the
/// three, constant outside. Normal maps hold x, y, z in red, green and blue, -1 to 1 as 0 to full scale; x
/// along growing u, y towards the image's first row, z out of the surface.
class SurfaceTextures {
public:
    /// Factor and maps of one material slot.
    struct Slot {
        std::vector<double> factor; ///< per band; empty: 1
        PlacedTexture albedo, normal;
    };
    /// Parameter map: a parameter of the material from an image of one plane, `at_zero` + texel * `gain`.
    struct Map {
        std::size_t parameter; ///< in the order of varying_parameters()
        PlacedTexture texture;
        double at_zero, gain;
        std::shared_ptr<const ProceduralTexture> model{}; ///< in place of `texture`; null: none
    };

    /// `slots`: at least one, indexed by Shape::material_slot(). `latlon`: map by longitude and latitude even
    /// where the shape has texture coordinates of its own; the image's left edge is at `left_longitude_rad`,
    /// its first row at +90 degrees. Textures with a place of their own (PlacedTexture) are there instead:
    /// outside it their factor is 1, parameters have their constants, normals stay and so does emission.
    SurfaceTextures(std::vector<Slot> slots, const std::vector<SpectralBand>& bands, bool latlon,
                    double left_longitude_rad);
    /// Sets the parameter maps; `constants`: the values of all varying_parameters(), used where no map is.
    void set_maps(std::vector<Map> maps, std::vector<double> constants);
    /// Sets the maps of a planet or terrain, by which the factor of all slots is multiplied.
    void set_nested(std::shared_ptr<const NestedAlbedo> nested);
    /// Lines on what was found when its files were read, for people.
    [[nodiscard]] std::vector<std::string> notes() const;
    /// Sets the emission map.
    void set_emission(PlacedTexture texture);
    /// Sets textures that users have written, whose mean is `mean`: a factor on the albedo of all slots.
    void set_albedo_model(std::shared_ptr<const ProceduralTexture> texture, double mean);
    /// As set_emission().
    void set_emission_model(std::shared_ptr<const ProceduralTexture> texture) {
        emission_model_ = std::move(texture);
    }
    /// Sets what a law of a user's own reads at the points that are hit.
    void set_model(std::shared_ptr<const ModelSurface> model) { model_ = std::move(model); }
    /// Sets the emission of such a law; the emission map, if there is one, is its argument.
    void set_model_emission(std::shared_ptr<const ModelSurface> emission, std::vector<double> own) {
        model_emission_ = std::move(emission);
        own_emission_ = std::move(own);
    }
    /// Adds a line to notes().
    void add_note(std::string line) { notes_.push_back(std::move(line)); }

    /// Whether parameters of the material vary over the surface.
    [[nodiscard]] bool varies() const { return !maps_.empty() || model_; }
    /// Whether the factor is the same in all bands.
    [[nodiscard]] bool grey() const { return grey_; }
    /// Whether a normal map turns its normals.
    [[nodiscard]] bool turns_normals() const {
        return std::any_of(slots_.begin(), slots_.end(), [](const Slot& s) { return bool{s.normal}; });
    }
    /// Whether an emission map varies the body's own light.
    [[nodiscard]] bool varies_emission() const {
        return bool{emission_} || emission_model_ || model_emission_;
    }
    /// Mean factor over slots and texels, first band.
    [[nodiscard]] double mean_factor() const { return mean_factor_; }
    [[nodiscard]] std::size_t slots() const { return slots_.size(); }

    /// Lets look-ups in giant textures take coarser levels while tiles are missing, instead of waiting for
    /// the file: they are real-time safe then. Not real-time safe itself.
    void stop_waiting() const;
    /// Look-ups that took a coarser level so far. Real-time safe.
    [[nodiscard]] std::uint64_t missed_tiles() const;

    /// Sets `factor[0, channels)`, by which the reflectance is multiplied, at the hits of `body`, seen by
    /// rays `width_m` wide there, and applies the normal map to the normals of `surface`. Other lanes get 1.
    /// Fills all 16 lanes of `varied` if varies().
    void apply(const Shape& shape, const RayPacket& view, const HitPacket& hits, std::int32_t body,
               const Doubles& width_m, std::size_t channels, const SampleTimes& time, SurfacePacket& surface,
               Channels& factor, ParameterPacket& varied) const;
    /// Sets `factor[0, channels)`, by which the body's own radiance is multiplied, at the hits of `body`, as
    /// apply() does for the reflectance; other lanes get 1. Only if varies_emission().
    void emission(const Shape& shape, const RayPacket& view, const HitPacket& hits, std::int32_t body,
                  const Doubles& width_m, std::size_t channels, const SampleTimes& time,
                  const SurfacePacket& surface, Channels& factor) const;
    /// The texture coordinates alone.
    void texture_coordinates(const Shape& shape, const HitPacket& hits, std::int32_t body,
                             const SurfacePacket& surface, UvPacket& out) const;

private:
    /// Replaces `factor`, that of the emission map, by the radiance of emission().
    void run_emission(const TexturePoints& points, const RayPacket& view, const UvPacket& at,
                      std::size_t channels, const SampleTimes& time, const SurfacePacket& surface,
                      Channels& factor) const;
    /// Sets `varied` and the factor of albedo models at the hits.
    void apply_models(const RayPacket& view, const HitPacket& hits, std::int32_t body, const UvPacket& at,
                      const Doubles& width_m, std::size_t channels, const SampleTimes& time,
                      const SurfacePacket& surface, Channels& factor, ParameterPacket& varied) const;
    [[nodiscard]] bool has_models() const;
    /// Calls `use(paged)` for the textures that are larger than memory.
    template<typename Use>
    void for_each_paged(const Use& use) const;
    [[nodiscard]] std::size_t slot_of(const Shape& shape, std::uint32_t primitive) const {
        return slots_.size() == 1 ? 0 : shape.material_slot(primitive);
    }

    std::vector<SpectralBand> spectral_bands_;
    std::vector<Slot> slots_;
    std::vector<std::vector<double>> weights_; ///< per slot: band x plane, for the albedo texture
    PlacedTexture emission_;                   ///< none: empty
    std::vector<std::string> notes_;
    std::vector<double> emission_weights_;                                   ///< band x plane
    std::shared_ptr<const ModelSurface> model_, model_emission_;             ///< null: none
    std::shared_ptr<const ProceduralTexture> albedo_model_, emission_model_; ///< null: none
    std::vector<double> own_emission_; ///< argument of emission() by band, without the map; empty: 0
    std::vector<Map> maps_;
    std::shared_ptr<const NestedAlbedo> nested_; ///< null: none
    std::vector<double> constants_;
    bool latlon_, grey_ = true;
    double left_turns_;
    double mean_factor_ = 1;
};

/// Texture coordinates by longitude and latitude, for a map of the whole body whose left edge is at
/// `left_turns` (longitude in full turns).
void uv_by_longitude(const SurfacePacket& surface, double left_turns, UvPacket& out);

} // namespace obscura::renderer
