// SPDX-License-Identifier: Apache-2.0
// Texture that a user has written in SuMoL: its values at the points that are hit.
#pragma once

#include "models/kinds/texture_program.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/textures/texture.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace obscura::renderer {

/// Where 16 lanes read a texture, and the footprints of their rays there.
struct TexturePoints {
    Lanes here;                      ///< lanes that read
    Doubles u, v;                    ///< texture coordinates
    TextureAxis longer[packet_size]; ///< edges of the footprint in them
    TextureAxis shorter[packet_size];
    Vec3s position;            ///< body frame, m
    Vec3s longer_m, shorter_m; ///< edges of the footprint
};

/// Immutable; thread-safe; all but the constructor real-time safe.
class ProceduralTexture {
public:
    /// Image that the model reads: its planes weighted for each band, or as they are.
    struct Image {
        std::shared_ptr<const Texture> texture; ///< null: none
        std::vector<double> weights;            ///< band x plane; empty: channels are planes
    };
    /// `images`: of Model::parameters(), and behind them that of the argument `tex`.
    ProceduralTexture(std::shared_ptr<const models::TextureProgram> program, std::vector<Image> images);

    /// Sets out[0, channels) at the lanes `points.here`; NaN: there is no data.
    void sample(const TexturePoints& points, std::size_t channels, Channels& out) const;

    /// Whether it is the same in all bands.
    [[nodiscard]] bool grey() const { return program_->outputs() == 1; }
    /// Values of the first band over the whole texture, or the whole body where it is read by positions.
    struct Range {
        double least = 0, largest = 0, mean = 0;
        double no_data_share = 0, infinite_share = 0, negative_share = 0;
        std::string infinite_at{}, negative_at{}, largest_at{}; ///< "at longitude 10, latitude -20 deg"
    };
    /// `radius_m`: of the positions.
    [[nodiscard]] Range range(double radius_m) const;
    [[nodiscard]] const std::vector<Image>& images() const { return images_; }
    [[nodiscard]] const models::TextureProgram& program() const { return *program_; }

private:
    struct Rows;
    void read(std::size_t index, const TexturePoints& points, Rows& rows) const;

    std::shared_ptr<const models::TextureProgram> program_;
    std::vector<Image> images_;
};

} // namespace obscura::renderer
