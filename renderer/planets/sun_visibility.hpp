// SPDX-License-Identifier: Apache-2.0
// Visibility of the Sun kept beside the tiles of a terrain: means of visibility times normal, with mip
// levels.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/detail_view.hpp"
#include "terrain/surface_domain.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace obscura::renderer {

class RockTracer;
struct SurfaceNode;
class SurfaceTiles;

/// Sun for which a terrain keeps visibility: the centre turned to the nearest of directions about
/// `sun_step_rad` apart and its distance rounded, so that it stays the same for a while and depends on
/// nothing but `sun_m`.
[[nodiscard]] SunSeen rounded_sun(Vec3 sun_m, double radius_m);
/// 0.05 degrees: of the Moon's Sun, six minutes. With the Sun 8 degrees high, a shadow of ten pixels is wrong
/// by a twentieth of a pixel at most.
inline constexpr double sun_step_rad = 0.05 * 0.017453292519943295;

/// Width of the texels that a ray takes over its own width.
inline constexpr double sun_texel_widths = 0.7;
/// Standard deviation, over the ray's width, of the mean that it gets: of a texel and of the interpolation
/// between texels.
inline constexpr double sun_mean_sigma = sun_texel_widths / 2;

/// Visibility of the Sun in one tile: mip level k has texels of 2^k x 2^k cells, from 1 (two cells) to that
/// of the whole tile. Plain data, 86 KiB; constant while it can be reached.
struct SunTile {
    static constexpr int first_level = 1, last_level = 8;
    static constexpr std::size_t texel_count = 21845;

    SunSeen sun;
    std::uint64_t born = 0; ///< version of SurfaceTiles that published it
    std::chrono::steady_clock::time_point made_at;
    std::array<std::uint32_t, texel_count> texels;

    /// Place of a level's texels, of 2^(8 - level) each way.
    [[nodiscard]] static constexpr std::size_t offset(int level) {
        return ((std::size_t{1} << (2 * (last_level - level))) - 1) / 3;
    }
    /// Components from -1 to 1 in steps of 1 / 511, ten bits each.
    [[nodiscard]] static std::uint32_t pack(Vec3 v);
    [[nodiscard]] static Vec3 unpack(std::uint32_t texel) {
        const auto part = [&](unsigned shift) {
            return static_cast<double>(static_cast<std::int32_t>(texel << shift) >> 22);
        };
        return Vec3{part(22), part(12), part(2)} * (1.0 / 511);
    }
};

/// Keeps a SunTile for each tile that rays ask for. In each, of all samples in the middles of cells, towards
/// the Sun's disc over the tiles of the same level, the mean of the normals (body frame) that see the Sun: of
/// it follows the light of a Lambertian surface without further rays, and to first order in the spread of
/// normals that of others.
///
/// Threads: as SurfaceTiles. What is kept depends on the tile and on the SunSeen alone.
class SunVisibility {
public:
    /// Room for as many as `tiles` has slots, and an eighth more, for those that are replaced.
    SunVisibility(const SurfaceTiles& tiles, std::size_t slots);
    ~SunVisibility();
    SunVisibility(const SunVisibility&) = delete;
    SunVisibility& operator=(const SunVisibility&) = delete;

    /// Lets rocks of the terrain cast shadows too. Before anything is made; `rocks` outlives the last use.
    void set_rocks(const RockTracer& rocks) { rocks_ = &rocks; }

    /// Memory of each slot.
    [[nodiscard]] static std::size_t slot_bytes();

    /// Visibility of the tile in the view's version, or of the nearest tile above it that has one, `levels`
    /// above; null: none has. Missing ones, and those of another Sun, are requested, or made if the view
    /// waits.
    [[nodiscard]] const SunTile* find(SurfaceNode& node, const DetailView& view, int& levels) const;

    /// Makes the visibility of a tile; false: there is no room until frames are done, it has been
    /// replaced within the last second, which is longer than any frame, or `pause`, which is called after
    /// every millisecond of work or so, returned false. May throw what layers throw. `wait`: takes more
    /// memory instead.
    bool make(SurfaceNode& node, const SunSeen& sun, bool wait,
              const std::function<bool()>& pause = {}) const;
    /// How many have been made so far. Real-time safe.
    [[nodiscard]] std::uint64_t made() const { return made_.load(std::memory_order_relaxed); }

    /// As SurfaceTiles::keep_resident().
    bool keep_resident() const;
    /// A tile goes whose rays are all done.
    void release(SurfaceNode& node) const;

private:
    struct Retired {
        const SunTile* tile;
        std::uint64_t epoch;
    };

    bool fill(const SurfaceNode& node, SunTile& out, const std::function<bool()>& pause) const;
    SunTile* take(bool wait) const;
    void give(const SunTile* tile) const;
    void retire(const SunTile* tile) const;

    const SurfaceTiles& tiles_;
    const RockTracer* rocks_ = nullptr; ///< null: none
    std::byte* arena_ = nullptr;
    std::size_t slots_ = 0;
    static constexpr std::size_t stripes = 64;
    mutable std::array<std::mutex, stripes> making_; ///< by slot of the tile: one thread makes it
    mutable std::atomic<std::uint64_t> made_{0};
    mutable std::mutex mutex_; ///< of what follows
    mutable std::vector<std::byte*> free_;
    mutable std::vector<Retired> retired_;
};

} // namespace obscura::renderer
