// SPDX-License-Identifier: Apache-2.0
// Image texture: mip pyramid, filtered anisotropically over a ray's footprint.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

namespace obscura::renderer {

class PagedTexture;

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
///
/// A giant texture has its texels in a file, as they are there (see PagedTexture): its levels are those of
/// the file, odd sizes rounded up.
class Texture {
public:
    /// Beyond the image: it repeats in u and v, repeats in u and has its outer rows in v, or has its outer
    /// texels.
    enum class Edge : std::uint8_t { repeat, clamp, clamp_both };
    static constexpr std::size_t max_planes = 16;

    /// `planes` are row-major, width x height each; all values finite.
    Texture(std::int32_t width, std::int32_t height, const std::vector<std::vector<float>>& planes, Edge edge,
            bool rgb = false);
    /// The texels of a file that is larger than memory.
    Texture(std::shared_ptr<PagedTexture> paged, Edge edge);

    /// Whether the planes are red, green and blue, rather than spectral bands.
    [[nodiscard]] bool rgb() const { return rgb_; }

    [[nodiscard]] std::size_t planes() const { return planes_.size(); }
    /// Texels of the finest level across and down.
    [[nodiscard]] double width() const { return width_; }
    [[nodiscard]] double height() const { return height_; }
    [[nodiscard]] double mean(std::size_t plane) const { return planes_[plane].mean; }
    [[nodiscard]] double least(std::size_t plane) const { return planes_[plane].least; }
    [[nodiscard]] double largest(std::size_t plane) const { return planes_[plane].largest; }
    [[nodiscard]] std::size_t bytes() const;
    /// Null: all texels are in memory.
    [[nodiscard]] PagedTexture* paged() const { return paged_.get(); }

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
        double offset, scale; ///< of texels
        double least, largest, mean;
    };

    void add_bilinear(const Level& level, double u, double v, double weight, double* out) const;

    Edge edge_;
    bool rgb_;
    std::vector<Plane> planes_;
    std::vector<Level> levels_;
    std::vector<std::uint16_t> texels_;
    std::shared_ptr<PagedTexture> paged_; ///< null: texels_
    std::size_t level_count_ = 0;
    double width_ = 0, height_ = 0; ///< texels of the finest level
};

/// Transfer function from the numbers of a file to factors.
enum class TextureCoding : std::uint8_t {
    linear, ///< integers over full scale; reals unchanged
    srgb,   ///< display images, IEC 61966-2-1
};

/// Reads the colour planes of an image (images/image.hpp), or opens a giant texture (.obt), whose values are
/// taken as they are. Throws InputError if it cannot be read, has more than 16 planes, a value that is not
/// finite or, other than a giant texture, more than 2^26 texels. `edge` chooses by width and height.
[[nodiscard]] Texture read_texture(const std::filesystem::path& file, TextureCoding coding,
                                   const std::function<Texture::Edge(std::int64_t, std::int64_t)>& edge);
[[nodiscard]] inline Texture read_texture(const std::filesystem::path& file, TextureCoding coding,
                                          Texture::Edge edge) {
    return read_texture(file, coding, [edge](std::int64_t, std::int64_t) { return edge; });
}

/// A texture whose texels may be missing in places, where means of what is around stand for them.
struct MapTexture {
    std::shared_ptr<const Texture> texture;
    std::int64_t width = 0, height = 0;
    double full_scale = 1;       ///< number of the file that a texel of 1 stands for, of linear coding
    std::vector<bool> missing{}; ///< row-major, of any plane; empty: none
};
/// As read_texture(), of a file of at most 2^26 texels also where texels are missing.
[[nodiscard]] MapTexture
read_map_texture(const std::filesystem::path& file, TextureCoding coding,
                 const std::function<Texture::Edge(std::int64_t, std::int64_t)>& edge);

} // namespace obscura::renderer
