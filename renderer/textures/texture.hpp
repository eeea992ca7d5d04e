// SPDX-License-Identifier: Apache-2.0
// Image texture: mip pyramid, filtered anisotropically over a ray's footprint.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::renderer {

/// Axis of a footprint in texture coordinates (u to the right, v down, 1 each across the image).
struct TextureAxis {
    double u = 0, v = 0;
};

/// Mip pyramid of one or more planes of an image. Immutable; thread-safe. Texels have 16 bits between the
/// smallest and the largest value of each plane: an error of at most 8e-6 of that range.
///
/// Each mip level halves both sizes (odd sizes rounded down, texels weighted by the area that they cover),
/// down to one texel: all levels have the same mean. Interpolation is linear between levels and between
/// texels.
class Texture {
public:
    enum class Edge : std::uint8_t { repeat, clamp };
    static constexpr std::size_t most_planes = 16;

    /// `planes` are row-major, width x height each; all values finite. u repeats; v repeats or is clamped
    /// (`edge`).
    Texture(std::int32_t width, std::int32_t height, const std::vector<std::vector<float>>& planes, Edge edge,
            bool rgb = false);

    /// Whether the planes are red, green and blue, rather than spectral bands.
    [[nodiscard]] bool rgb() const { return rgb_; }

    [[nodiscard]] std::size_t planes() const { return planes_.size(); }
    [[nodiscard]] std::int32_t width() const { return levels_[0].width; }
    [[nodiscard]] std::int32_t height() const { return levels_[0].height; }
    [[nodiscard]] double mean(std::size_t plane) const;
    [[nodiscard]] double least(std::size_t plane) const { return planes_[plane].offset; }
    [[nodiscard]] double largest(std::size_t plane) const;
    [[nodiscard]] std::size_t bytes() const { return texels_.size() * sizeof texels_[0]; }

    /// Anisotropic filtering: means over the parallelogram about (u, v) with the edges `a` and `b`, by up to
    /// 16 probes along the longer edge (as McCormack et al., Feline, SIGGRAPH 1999), each from the mip levels
    /// of about the length of the shorter edge. Fills `out[0, planes)`.
    void sample(double u, double v, TextureAxis a, TextureAxis b, double* out) const;

private:
    struct Level {
        std::int32_t width, height;
        std::size_t first; ///< first texel of the first plane; the others follow
    };
    struct Plane {
        double offset, scale;
    };

    void add_bilinear(const Level& level, double u, double v, double weight, double* out) const;

    Edge edge_;
    bool rgb_;
    std::vector<Plane> planes_;
    std::vector<Level> levels_;
    std::vector<std::uint16_t> texels_;
};

/// Transfer function from the numbers of a file to factors.
enum class TextureCoding : std::uint8_t {
    linear, ///< integers over full scale; reals unchanged
    srgb,   ///< display images, IEC 61966-2-1
};

/// Reads the colour planes of an image (images/image.hpp). Throws InputError if it cannot be read, has more
/// than 16 planes or 2^26 texels, or a value that is not finite.
[[nodiscard]] Texture read_texture(const std::filesystem::path& file, TextureCoding coding,
                                   Texture::Edge edge);

} // namespace obscura::renderer
