// SPDX-License-Identifier: Apache-2.0
// Tiles of a terrain in memory: a quadtree per face, grown where rays need it, in an arena of fixed slots.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/detail_view.hpp"
#include "renderer/planets/tile_cones.hpp"
#include "terrain/tiles/tile_maker.hpp"

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace obscura::renderer {

class RockTracer;
struct SunTile;
class SunVisibility;

/// In SurfaceNode::wanted: visibility of the Sun.
inline constexpr std::uint32_t wanted_sun = 1u << 4;

/// A rock that stands on a tile: a stretched and turned copy of one of a few forms.
struct Rock {
    Vec3 centre_m;
    double radius_m = 0; ///< of a ball about it
    /// Its axes over their half lengths: gradients of the form's coordinates.
    std::array<Vec3, 3> axes_per_m{};
    std::uint32_t form = 0;
};

/// A tile in its slot. Heights called unit heights are in units of SurfaceDomain::unit_m().
struct SurfaceNode {
    // Constant while the node can be reached.
    Vec3 centre_m;             ///< of a sphere about the tile's part of the reference surface, body frame
    double radius_m = 0;       ///< of that sphere
    double spacing_m = 0;      ///< of its vertices, at most
    double half_cells = 0;     ///< cells per unit of u and v
    double own_highest = 0;    ///< unit height of its highest vertex
    double own_least = 0;      ///< and of its lowest
    double least = 0;          ///< bound of the unit heights of the tile and all below it
    double child_highest[4];   ///< bounds of the unit heights of each child and all below it
    terrain::Cap child_cap[4]; ///< where each child is
    SurfaceNode* parent = nullptr;
    std::uint64_t born = 0; ///< version that published it
    std::uint32_t slot = 0;
    std::uint8_t quarter = 0;        ///< of the parent
    std::vector<Rock> rocks;         ///< that are domes in its parent
    terrain::LostSlopes lost_slopes; ///< only if they are kept

    std::array<std::atomic<SurfaceNode*>, 4> child{}; ///< null: not made
    std::atomic<std::uint32_t> wanted{0};             ///< bit per child that rays missed, wanted_sun
    std::atomic<std::uint64_t> used{0};               ///< SurfaceTiles::clock() of the last use

    // Tiles of SunVisibility. The second one is for frames that began before the first was there.
    std::atomic<const SunTile*> sun{nullptr}, sun_before{nullptr};

    // Under the mutex of SurfaceTiles.
    int making = 0;       ///< children being made
    bool retired = false; ///< cannot be reached from now on

    terrain::SurfaceTile tile;
    TileCones cones; ///< in scaled space, distances as angles
};

/// Largest number of tiles at once: HitPacket::primitive holds the slot in its upper half.
inline constexpr std::size_t max_tiles = 65536;

/// Which tiles a ray takes: those whose cells are as small as asked for at their distance from the eye.
struct LevelChoice {
    const DetailView* view = nullptr; ///< null: `fixed_level`
    double reach = 0;                 ///< distance at which a cell of 1 m is small enough
    int fixed_level = 0;

    /// Whether the children of the tile are taken instead of it.
    [[nodiscard]] bool splits(const SurfaceNode& node) const {
        if (view == nullptr) return node.tile.key.level < fixed_level;
        if (node.tile.key.level >= terrain::deepest_level) return false;
        const double near_m = node.radius_m + node.spacing_m * reach;
        return length_squared(node.centre_m - view->eye_m) < near_m * near_m;
    }
    /// Width of the tile's cells over that asked for; above 1 if splits() but for fixed levels.
    [[nodiscard]] double coarseness(const SurfaceNode& node) const;
};

/// Which craters and boulders of a terrain the truth of a frame lists.
struct FeatureLimits {
    double min_px = 8; ///< diameter in the picture
    std::size_t most = 100;
};

/// The first tiles, of level 0 and of the pinned levels, stay. All others are made when a ray of a DetailView
/// with `wait` meets their bounds, or by a TileLoader; when the arena is full, those that were used least
/// recently go.
///
/// Threads. Rays hold a Pin while they use a DetailView and the primitives that came of it: tiles that are
/// retired meanwhile keep their slots until all pins of that time are gone. Without `wait`, child() neither
/// blocks nor allocates. With it, each tile is made by one thread while others that need it wait; if no slot
/// is free, because all are pinned, more memory than the arena is taken until they are free again. What rays
/// meet does not depend on the order in which tiles are made.
class SurfaceTiles {
public:
    struct Settings {
        std::uint64_t arena_bytes = std::uint64_t{512} << 20;
        int pinned_levels = 3; ///< levels 0, 1 and 2 stay once made
        /// Largest width of cells in pixels. Most are half as wide, as the level that a sample takes is
        /// chosen at random: tests/bench/planet_levels.py measures what is lost.
        double cell_px = 0.5;
        FeatureLimits listed{};
        bool sun_visibility = false;
        bool lost_slopes = false; ///< whether tiles keep them
    };
    class Pin;

    SurfaceTiles(terrain::TileMaker maker, Settings settings);
    ~SurfaceTiles();
    SurfaceTiles(const SurfaceTiles&) = delete;
    SurfaceTiles& operator=(const SurfaceTiles&) = delete;

    [[nodiscard]] const terrain::TileMaker& maker() const { return maker_; }
    [[nodiscard]] FeatureLimits listed() const { return settings_.listed; }
    [[nodiscard]] const terrain::SurfaceDomain& domain() const { return maker_.domain(); }
    [[nodiscard]] double cell_px() const { return settings_.cell_px; }
    [[nodiscard]] bool keeps_lost_slopes() const { return settings_.lost_slopes; }
    /// Bounds of the unit heights of the whole terrain.
    [[nodiscard]] double least() const { return least_; }
    [[nodiscard]] double largest() const { return largest_; }

    /// Rocks that cast shadows in what is kept of the Sun's visibility. Before the first use.
    void set_rocks(const RockTracer& rocks);
    /// Null: not kept.
    [[nodiscard]] const SunVisibility* sun_visibility() const { return sun_visibility_.get(); }

    [[nodiscard]] SurfaceNode* root(std::size_t face) const { return roots_[face]; }
    /// The child of a tile that splits, or null if it is missing and is not to be made now: then the tile
    /// itself serves for it. May throw what layers throw, with `wait`.
    [[nodiscard]] SurfaceNode* child(SurfaceNode& node, unsigned quarter, bool wait,
                                     std::uint64_t version) const {
        if (SurfaceNode* const there = made(node, quarter);
            there != nullptr && (wait || there->born <= version))
            return there;
        if (wait) return make_child(node, quarter);
        const std::uint32_t bit = 1u << quarter;
        if ((node.wanted.load(std::memory_order_relaxed) & bit) == 0)
            node.wanted.fetch_or(bit, std::memory_order_relaxed);
        return nullptr;
    }
    /// The child if it is there; counts as a use of it.
    [[nodiscard]] SurfaceNode* made(SurfaceNode& node, unsigned quarter) const {
        SurfaceNode* const there = node.child[quarter].load(std::memory_order_acquire);
        if (there != nullptr) {
            const std::uint64_t now = clock();
            if (there->used.load(std::memory_order_relaxed) != now)
                there->used.store(now, std::memory_order_relaxed);
        }
        return there;
    }
    /// Node of the slot in the upper half of HitPacket::primitive.
    [[nodiscard]] SurfaceNode& in_slot(std::uint32_t slot) const { return *table_[slot]; }

    /// Makes the child unless it is there. Its version is that of the next publish().
    SurfaceNode* make_child(SurfaceNode& node, unsigned quarter) const;
    /// Makes all tiles of the pinned levels, by several threads.
    void make_pinned() const;
    /// Takes the arena's pages and keeps them, in huge ones where the kernel has them; false if the limit of
    /// locked memory does not allow it: then they are taken all the same.
    bool keep_resident() const;

    /// Tiles made from now on belong to the next version. Real-time safe.
    void publish() const { version_.fetch_add(1, std::memory_order_release); }
    [[nodiscard]] std::uint64_t version() const { return version_.load(std::memory_order_acquire); }
    /// A frame begins, whose rays all see the version of now: see version_of(). Real-time safe.
    void begin_frame(std::uint64_t frame) const {
        frames_[frame % frames_.size()].store(frame << 32 | (version() & 0xffffffffu),
                                              std::memory_order_release);
    }
    /// The version of a frame among the last ones that began, or that of now.
    [[nodiscard]] std::uint64_t version_of(std::uint64_t frame) const {
        const std::uint64_t entry = frames_[frame % frames_.size()].load(std::memory_order_acquire);
        const std::uint64_t now = version();
        if (entry >> 32 != (frame & 0xffffffffu)) return now;
        return now - ((now - entry) & 0xffffffffu);
    }
    /// Calls `use` with each tile that has missing children which rays wanted and takes those bits from it.
    /// The caller holds a Pin.
    template<typename Use>
    void take_wanted(const Use& use) const {
        const std::lock_guard lock(mutex_);
        for (SurfaceNode* const node : std::span(table_).first(slots_used_))
            if (node != nullptr && !node->retired && node->born <= version() + 1)
                if (const std::uint32_t bits = node->wanted.exchange(0, std::memory_order_relaxed); bits != 0)
                    use(*node, bits);
    }

    [[nodiscard]] Pin pin() const;
    /// Begins an epoch and returns the one before: pins of it and of earlier ones may see what was unlinked
    /// until now.
    [[nodiscard]] std::uint64_t end_epoch() const { return epoch_.fetch_add(1, std::memory_order_seq_cst); }
    /// Oldest of the pins; the largest number if there are none.
    [[nodiscard]] std::uint64_t oldest_pin() const;
    /// Calls `use` with each tile that can be reached. The caller holds a Pin.
    template<typename Use>
    void for_each(const Use& use) const {
        const std::lock_guard lock(mutex_);
        for (SurfaceNode* const node : std::span(table_).first(slots_used_))
            if (node != nullptr && !node->retired && node->born <= version() + 1) use(*node);
    }

    /// Slots of the arena, tiles that are made, and slots beyond the arena.
    struct Usage {
        std::size_t slots = 0, tiles = 0, beyond = 0;
        std::uint64_t made = 0; ///< since the beginning
        /// Vertices since the beginning whose heights were beyond the layers' bounds, which is a fault of a
        /// layer: see terrain::TileMaker::make().
        std::uint64_t clamped = 0;
    };
    [[nodiscard]] Usage usage() const;
    /// Usage::made. Real-time safe.
    [[nodiscard]] std::uint64_t made() const { return clock() - 1; }
    [[nodiscard]] static std::size_t slot_bytes();

private:
    struct Retired {
        SurfaceNode* node;
        std::uint64_t epoch;
    };

    [[nodiscard]] std::uint64_t clock() const { return clock_.load(std::memory_order_relaxed); }
    SurfaceNode* take_slot() const;
    void retire_least_used() const;
    void reclaim() const;
    void release(SurfaceNode* node) const;
    SurfaceNode* fill(terrain::TileKey key, SurfaceNode* parent, SurfaceNode* slot) const;

    terrain::TileMaker maker_;
    Settings settings_;
    double least_ = 0, largest_ = 0;
    std::array<SurfaceNode*, 6> roots_{};
    std::unique_ptr<SunVisibility> sun_visibility_;

    std::byte* arena_ = nullptr;
    std::size_t slots_ = 0;

    static constexpr std::size_t stripes = 64;
    mutable std::array<std::mutex, stripes> making_; ///< by key: one thread makes a tile
    mutable std::mutex mutex_;                       ///< of what follows
    mutable std::vector<SurfaceNode*> table_;        ///< by slot; null: free. Read without the mutex
    mutable std::size_t slots_used_ = 0;             ///< all of `table_` from here on is free
    mutable std::vector<std::uint32_t> free_;        ///< slots of the arena, the next one last
    mutable std::vector<std::uint32_t> free_beyond_;
    mutable std::size_t tiles_ = 0, beyond_ = 0;
    mutable std::vector<Retired> retired_;
    mutable std::vector<std::unique_ptr<terrain::TileMaker::Scratch>> scratch_;

    mutable std::atomic<std::uint64_t> clock_{1}; ///< tiles made
    mutable std::atomic<std::uint64_t> clamped_{0};
    mutable std::atomic<std::uint64_t> version_{1};
    mutable std::array<std::atomic<std::uint64_t>, 16> frames_{}; ///< key in the upper half, version
    mutable std::atomic<std::uint64_t> epoch_{1};
    /// Epochs at which pins were taken; 0: none. Threads that find none free wait for one.
    static constexpr std::size_t max_pins = 1024;
    struct alignas(64) PinSlot {
        std::atomic<std::uint64_t> epoch{0};
    };
    mutable std::array<PinSlot, max_pins> pins_;
};

/// Keeps all tiles that can be reached now in their slots. Not copied; may be destroyed by another thread.
class SurfaceTiles::Pin {
public:
    Pin() = default;
    explicit Pin(std::atomic<std::uint64_t>* slot) : slot_(slot) {}
    ~Pin() { release(); }
    Pin(Pin&& other) noexcept : slot_(other.slot_) { other.slot_ = nullptr; }
    Pin& operator=(Pin&& other) noexcept {
        if (this != &other) {
            release();
            slot_ = other.slot_;
            other.slot_ = nullptr;
        }
        return *this;
    }

private:
    void release() {
        if (slot_ != nullptr) slot_->store(0, std::memory_order_release);
        slot_ = nullptr;
    }

    std::atomic<std::uint64_t>* slot_ = nullptr;
};

} // namespace obscura::renderer
