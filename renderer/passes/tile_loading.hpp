// SPDX-License-Identifier: Apache-2.0
// Loading of the tiles of a renderer's terrains: beside the rendering, or before it.
#pragma once

#include "core/time.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/planets/tile_loader.hpp"
#include "renderer/renderer.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace obscura::renderer {

/// Owns the threads that make tiles while rows are rendered, unless these wait for tiles. Thread-safe.
class TileLoading {
public:
    /// Makes the tiles that terrains always have. `built` must outlive it; needs no lighting.
    explicit TileLoading(const BuiltScene& built);

    /// Counts a call that renders while it lasts: the loaders leave the cores to it. Real-time safe.
    class ActiveCallGuard {
    public:
        explicit ActiveCallGuard(const TileLoading& tiles) : calls_(tiles.under_way_) {
            calls_.fetch_add(1, std::memory_order_relaxed);
        }
        ~ActiveCallGuard() { calls_.fetch_sub(1, std::memory_order_relaxed); }
        ActiveCallGuard(const ActiveCallGuard&) = delete;
        ActiveCallGuard& operator=(const ActiveCallGuard&) = delete;

    private:
        std::atomic<int>& calls_;
    };

    /// What all requests of a frame have in common, for the tiles that it shows; 0: those that are there.
    [[nodiscard]] std::uint64_t frame_key(std::uint64_t frame_id, std::optional<Time> common_mid) const;
    /// The first rows of a frame follow: it sees the tiles of now, and the loaders are told where the next
    /// second's frames will be seen from. Real-time safe.
    void begin_frame(const RenderRequest& request) const;
    /// See Renderer::load_tiles().
    bool load(const RenderRequest& request, const std::function<bool(double)>& go_on) const;
    /// See Renderer.
    [[nodiscard]] std::uint64_t made() const noexcept;
    [[nodiscard]] std::vector<Renderer::TerrainTiles> usage() const;

private:
    void load_row(const RenderRequest& request, std::int32_t r, Scratch& s) const;
    void predict_views(const RenderRequest& request) const;

    const BuiltScene& built_;
    mutable std::atomic<int> under_way_{0};            ///< calls of render()
    std::vector<std::unique_ptr<TileLoader>> loaders_; ///< of the terrains, unless rendering waits for tiles
};

} // namespace obscura::renderer
