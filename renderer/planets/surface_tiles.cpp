// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/surface_tiles.hpp"

#include "core/error.hpp"
#include "renderer/planets/rocks.hpp"
#include "renderer/planets/sun_visibility.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <thread>

namespace obscura::renderer {
namespace {

constexpr std::size_t page_bytes = 4096;

std::size_t stripe_of(terrain::TileKey key, std::size_t stripes) {
    const std::uint64_t mixed =
        (key.i * 0x9e3779b97f4a7c15ull) ^ (key.j * 0xc2b2ae3d27d4eb4full) ^ (key.level * 8ull + key.face);
    return static_cast<std::size_t>((mixed ^ (mixed >> 29)) % stripes);
}

/// Largest ratio of distances on the plane of a face to angles in a tile: at its corner farthest from the
/// middle.
double smallest_cells(const terrain::SurfaceDomain& domain, terrain::TileKey key) {
    if (domain.is_plane()) return 1;
    const auto farthest = [&](std::uint32_t index) {
        return std::max(std::abs(terrain::SurfaceDomain::coordinate(key.level, index, 0)),
                        std::abs(terrain::SurfaceDomain::coordinate(key.level, index, terrain::tile_cells)));
    };
    const double u = farthest(key.i), v = farthest(key.j);
    return 1 + u * u + v * v;
}

} // namespace

double LevelChoice::coarseness(const SurfaceNode& node) const {
    if (view == nullptr) return 1;
    const double near_m =
        std::max(length(node.centre_m - view->eye_m) - node.radius_m, 1e-3 * node.spacing_m);
    return node.spacing_m * reach / near_m;
}

std::size_t SurfaceTiles::slot_bytes() {
    return (sizeof(SurfaceNode) + page_bytes - 1) / page_bytes * page_bytes;
}

SurfaceTiles::SurfaceTiles(terrain::TileMaker maker, Settings settings)
    : maker_(std::move(maker)),
      settings_(settings),
      slots_(
          std::min(static_cast<std::size_t>(
                       settings.arena_bytes /
                       (slot_bytes() + (settings.sun_visibility ? SunVisibility::slot_bytes() * 9 / 8 : 0))),
                   max_tiles / 2)) {
    const std::uint8_t faces = domain().faces();
    least_ = std::numeric_limits<double>::infinity();
    largest_ = -least_;
    for (std::uint8_t face = 0; face < faces; ++face) {
        const terrain::ReducedRange range = maker_.range({face, 0, 0, 0});
        least_ = std::min(least_, range.least / domain().unit_m());
        largest_ = std::max(largest_, range.largest / domain().unit_m());
    }
    if (!(least_ > -0.9 && largest_ < 10))
        throw InputError(fmt::format("heights from {:.3g} to {:.3g} {}: allowed is -0.9 to 10", least_,
                                     largest_, domain().is_plane() ? "half edges" : "radii"));
    void* const memory = mmap(nullptr, slots_ * slot_bytes(), PROT_READ | PROT_WRITE,
                              MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    arena_ = static_cast<std::byte*>(memory);
    // Rays go to and fro between tiles: with small pages, half of their time is spent on addresses.
    madvise(arena_, slots_ * slot_bytes(), MADV_HUGEPAGE);
    table_.resize(max_tiles);
    for (std::size_t slot = slots_; slot > 0; --slot)
        free_.push_back(static_cast<std::uint32_t>(slot - 1));
    for (std::size_t slot = max_tiles; slot > slots_; --slot)
        free_beyond_.push_back(static_cast<std::uint32_t>(slot - 1));
    if (settings.sun_visibility) sun_visibility_ = std::make_unique<SunVisibility>(*this, slots_);
    for (std::uint8_t face = 0; face < faces; ++face) {
        std::unique_lock lock(mutex_);
        SurfaceNode* const slot = take_slot();
        lock.unlock();
        roots_[face] = fill({face, 0, 0, 0}, nullptr, slot);
        lock.lock();
        ++tiles_;
    }
}

SurfaceTiles::~SurfaceTiles() {
    for (SurfaceNode* const node : table_)
        if (node != nullptr) release(node);
    if (arena_ != nullptr) munmap(arena_, slots_ * slot_bytes());
}

void SurfaceTiles::set_rocks(const RockTracer& rocks) {
    if (sun_visibility_) sun_visibility_->set_rocks(rocks);
}

void SurfaceTiles::release(SurfaceNode* node) const {
    const std::uint32_t slot = node->slot;
    table_[slot] = nullptr;
    if (sun_visibility_) sun_visibility_->release(*node);
    node->~SurfaceNode();
    if (slot < slots_) {
        free_.push_back(slot);
    } else {
        ::operator delete (node, std::align_val_t{page_bytes});
        free_beyond_.push_back(slot);
        --beyond_;
    }
}

std::uint64_t SurfaceTiles::oldest_pin() const {
    std::uint64_t oldest = std::numeric_limits<std::uint64_t>::max();
    for (const PinSlot& pin : pins_)
        if (const std::uint64_t epoch = pin.epoch.load(std::memory_order_seq_cst); epoch != 0)
            oldest = std::min(oldest, epoch);
    return oldest;
}

void SurfaceTiles::reclaim() const {
    if (retired_.empty()) return;
    const std::uint64_t oldest = oldest_pin();
    std::erase_if(retired_, [&](const Retired& r) {
        if (r.epoch >= oldest || r.node->making > 0) return false;
        release(r.node);
        return true;
    });
}

void SurfaceTiles::retire_least_used() const {
    std::vector<SurfaceNode*> leaves;
    for (SurfaceNode* const node : table_) {
        if (node == nullptr || node->retired || node->making > 0 || node->parent == nullptr ||
            node->tile.key.level < settings_.pinned_levels || node->born == 0)
            continue;
        if (std::all_of(node->child.begin(), node->child.end(), [](const std::atomic<SurfaceNode*>& child) {
                return child.load(std::memory_order_relaxed) == nullptr;
            }))
            leaves.push_back(node);
    }
    const std::size_t share = std::min(leaves.size(), std::max<std::size_t>(slots_ / 8, 1));
    std::nth_element(leaves.begin(), leaves.begin() + static_cast<std::ptrdiff_t>(share), leaves.end(),
                     [](const SurfaceNode* a, const SurfaceNode* b) {
                         return a->used.load(std::memory_order_relaxed) <
                                b->used.load(std::memory_order_relaxed);
                     });
    leaves.resize(share);
    for (SurfaceNode* const node : leaves) {
        node->parent->child[node->quarter].store(nullptr, std::memory_order_seq_cst);
        node->retired = true;
        --tiles_;
    }
    const std::uint64_t epoch = end_epoch();
    for (SurfaceNode* const node : leaves)
        retired_.push_back({node, epoch});
}

SurfaceNode* SurfaceTiles::take_slot() const {
    if (free_.empty()) reclaim();
    if (free_.empty() && retired_.size() < slots_ / 8) {
        retire_least_used();
        reclaim();
    }
    if (!free_.empty()) {
        const std::uint32_t slot = free_.back();
        free_.pop_back();
        auto* const node = new (arena_ + slot * slot_bytes()) SurfaceNode;
        node->slot = slot;
        table_[slot] = node;
        slots_used_ = std::max<std::size_t>(slots_used_, slot + 1);
        return node;
    }
    if (free_beyond_.empty()) throw std::bad_alloc();
    void* const memory = ::operator new (sizeof(SurfaceNode), std::align_val_t{page_bytes});
    auto* const node = new (memory) SurfaceNode;
    node->slot = free_beyond_.back();
    free_beyond_.pop_back();
    table_[node->slot] = node;
    slots_used_ = std::max<std::size_t>(slots_used_, node->slot + 1);
    ++beyond_;
    return node;
}

SurfaceNode* SurfaceTiles::fill(terrain::TileKey key, SurfaceNode* parent, SurfaceNode* slot) const {
    std::unique_ptr<terrain::TileMaker::Scratch> scratch;
    {
        const std::lock_guard lock(mutex_);
        if (!scratch_.empty()) {
            scratch = std::move(scratch_.back());
            scratch_.pop_back();
        }
    }
    if (!scratch) scratch = std::make_unique<terrain::TileMaker::Scratch>();
    // Nested parallel loops of a layer must not take other work, which may need the tile that is made here.
    tbb::this_task_arena::isolate(
        [&] { clamped_.fetch_add(maker_.make(key, *scratch, slot->tile), std::memory_order_relaxed); });
    if (settings_.lost_slopes) slot->lost_slopes = maker_.lost_slopes(key, *scratch);
    const double per_m = 1 / domain().unit_m();
    const terrain::Cap cap = maker_.cap(key);
    slot->centre_m = cap.centre_m;
    slot->radius_m = cap.radius_m;
    slot->spacing_m = domain().spacing_m(key.level);
    slot->half_cells = std::ldexp(terrain::tile_cells / 2.0, key.level);
    slot->own_highest = slot->tile.maximum_m(terrain::pyramid_levels, 0, 0) * per_m;
    slot->own_least = slot->tile.min_m * per_m;
    make_cones(slot->tile, per_m * slot->half_cells * smallest_cells(domain(), key), slot->cones);
    slot->least = maker_.range(key).least * per_m;
    if (key.level < terrain::deepest_level)
        for (unsigned quarter = 0; quarter < 4; ++quarter) {
            slot->child_highest[quarter] = maker_.range(key.child(quarter)).largest * per_m;
            slot->child_cap[quarter] = maker_.cap(key.child(quarter));
        }
    slot->rocks = place_rocks(maker_, slot->tile, scratch->sample_spacings_m);
    slot->parent = parent;
    slot->used.store(clock_.fetch_add(1, std::memory_order_relaxed), std::memory_order_relaxed);
    const std::lock_guard lock(mutex_);
    scratch_.push_back(std::move(scratch));
    return slot;
}

SurfaceNode* SurfaceTiles::make_child(SurfaceNode& node, unsigned quarter) const {
    const terrain::TileKey key = node.tile.key.child(quarter);
    const std::lock_guard one(making_[stripe_of(key, stripes)]);
    if (SurfaceNode* const made = node.child[quarter].load(std::memory_order_acquire)) return made;
    SurfaceNode* slot = nullptr;
    {
        const std::lock_guard lock(mutex_);
        slot = take_slot();
        ++node.making;
    }
    try {
        fill(key, &node, slot);
    } catch (...) {
        const std::lock_guard lock(mutex_);
        --node.making;
        release(slot);
        throw;
    }
    const std::lock_guard lock(mutex_);
    slot->quarter = static_cast<std::uint8_t>(quarter);
    slot->born = version() + 1;
    --node.making;
    node.child[quarter].store(slot, std::memory_order_release);
    node.wanted.fetch_and(~(1u << quarter), std::memory_order_relaxed);
    if (node.retired) { // only rays that hold its parent can reach it
        slot->retired = true;
        retired_.push_back({slot, epoch_.load(std::memory_order_seq_cst)});
    } else {
        ++tiles_;
    }
    return slot;
}

void SurfaceTiles::make_pinned() const {
    std::vector<SurfaceNode*> parents(roots_.begin(), roots_.begin() + domain().faces());
    for (int level = 1; level < settings_.pinned_levels; ++level) {
        std::vector<SurfaceNode*> children(parents.size() * 4);
        tbb::parallel_for(std::size_t{0}, children.size(), [&](std::size_t k) {
            children[k] = make_child(*parents[k / 4], static_cast<unsigned>(k % 4));
        });
        parents = std::move(children);
    }
}

bool SurfaceTiles::keep_resident() const {
    const std::size_t bytes = slots_ * slot_bytes();
    const bool sun_too = !sun_visibility_ || sun_visibility_->keep_resident();
    if (mlock(arena_, bytes) == 0) return sun_too;
    madvise(arena_, bytes, MADV_POPULATE_WRITE);
    return false;
}

SurfaceTiles::Pin SurfaceTiles::pin() const {
    const std::size_t first = std::hash<std::thread::id>{}(std::this_thread::get_id());
    for (std::size_t k = 0;; ++k) {
        std::atomic<std::uint64_t>& slot = pins_[(first + k) % max_pins].epoch;
        std::uint64_t none = 0;
        if (slot.compare_exchange_strong(none, epoch_.load(std::memory_order_seq_cst),
                                         std::memory_order_seq_cst))
            return Pin(&slot);
    }
}

SurfaceTiles::Usage SurfaceTiles::usage() const {
    const std::lock_guard lock(mutex_);
    return {slots_, tiles_, beyond_, clock_.load(std::memory_order_relaxed) - 1,
            clamped_.load(std::memory_order_relaxed)};
}

} // namespace obscura::renderer
