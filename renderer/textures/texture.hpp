// SPDX-License-Identifier: Apache-2.0
// Image texture: mip pyramid, filtered anisotropically over a ray's footprint.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::renderer {

/// A direction in texture coordinates (u to the right, v down, 1 each across the image).
struct TextureAxis {
    double u = 0, v = 0;
};

/// One or more planes of an image. Immutable; any thread may call any member. Values are kept in 16 bits
/// between the least and the largest of each plane: an error of at most 8e-6 of that range.
///
/// Each level halves both sizes (odd ones rounded down, texels weighted by the area that they cover), down to
/// one texel: the mean is the same on all of them. Between levels and texels values are linear.
class Texture {
public:
    enum class Edge : std::uint8_t { repeat, clamp };
    static constexpr std::size_t most_planes = 16;

    /// `planes` are row-major, width x height each; all values finite. u repeats, v does as `edge` says.
    Texture(std::int32_t width, std::int32_t height, const std::vector<std::vector<float>>& planes, Edge edge,
            bool rgb = false);

    /// Whether the planes are red, green and blue, and not bands of their own.
    [[nodiscard]] bool rgb() const { return rgb_; }

    [[nodiscard]] std::size_t planes() const { return planes_.size(); }
    [[nodiscard]] std::int32_t width() const { return levels_[0].width; }
    [[nodiscard]] std::int32_t height() const { return levels_[0].height; }
    [[nodiscard]] double mean(std::size_t plane) const;
    [[nodiscard]] double least(std::size_t plane) const { return planes_[plane].offset; }
    [[nodiscard]] double largest(std::size_t plane) const;
    [[nodiscard]] std::size_t bytes() const { return texels_.size() * sizeof texels_[0]; }

    /// Means over the parallelogram about (u, v) with the edges `a` and `b`: up to 16 probes along the longer
    /// one (as McCormack et al., Feline, SIGGRAPH 1999), each from the levels of about the shorter one's
    /// size. Fills `out[0, planes)`.
    void sample(double u, double v, TextureAxis a, TextureAxis b, double* out) const;

private:
    struct Level {
        std::int32_t width, height;
        std::size_t first; ///< texel, of the first plane; the others follow
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

/// How the numbers of a file become factors.
enum class TextureCoding : std::uint8_t {
    linear, ///< integers over their full scale, reals as they are
    srgb,   ///< display pictures, IEC 61966-2-1
};

/// Reads the colours of an image (images/image.hpp). Throws InputError when it cannot be read, has more than
/// 16 planes or 2^26 texels, or values that are not finite.
[[nodiscard]] Texture read_texture(const std::filesystem::path& file, TextureCoding coding,
                                   Texture::Edge edge);

} // namespace obscura::renderer
