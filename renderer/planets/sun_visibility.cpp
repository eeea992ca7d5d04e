// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/sun_visibility.hpp"

#include "renderer/lights/sunlight.hpp"
#include "renderer/planets/packet_tracer.hpp"
#include "renderer/planets/rocks.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/planets/tile_tracer.hpp"
#include "terrain/cube_sphere.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <tuple>
#include <utility>

namespace obscura::renderer {
namespace {

using terrain::tile_cells;

constexpr std::size_t visibility_page_bytes = 4096;
/// How long frames that began before may still be under way.
constexpr auto max_frame = std::chrono::seconds(1);
/// Sun by which it may differ from that of the frame before it is replaced, in steps: the loader makes that
/// of a second ahead.
constexpr double fresh_steps = 1.5;

Vec3 times(Vec3 a, Vec3 b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

bool fresh(const SunSeen& kept, const SunSeen& now) {
    return length(kept.centre_m - now.centre_m) <= fresh_steps * sun_step_rad * length(now.centre_m) &&
           kept.radius_m == now.radius_m;
}

/// Numbers in [0,1) of a cell: where on the Sun's disc its sample looks.
std::pair<double, double> disc_point(terrain::TileKey key, std::uint32_t i, std::uint32_t j) {
    std::uint64_t x = (std::uint64_t{key.j} * tile_cells + j) << 32 | (key.i * std::uint64_t{tile_cells} + i);
    x += 0x9e3779b97f4a7c15ull * (key.face * 32ull + key.level + 1);
    // SplitMix64: Steele, Lea, Flood, OOPSLA 2014.
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    x ^= x >> 31;
    return {static_cast<double>(x >> 32) * 0x1p-32, static_cast<double>(x & 0xffffffffu) * 0x1p-32};
}

/// Places and normals of the middles of a tile's cells.
class CellMiddles {
public:
    CellMiddles(const terrain::SurfaceDomain& domain, const SurfaceNode& node)
        : domain_(domain),
          node_(node),
          radii_m_(domain.is_plane() ? Vec3{1, 1, 1} * domain.half_edge_m() : domain.radii_m()),
          inverse_radii_{1 / radii_m_.x, 1 / radii_m_.y, 1 / radii_m_.z} {}

    struct Middle {
        Vec3 position_m, smooth, facet; ///< body frame; unit normals
    };
    [[nodiscard]] Middle at(std::uint32_t i, std::uint32_t j) const {
        const TileGradients gradients = TileTracer::gradients(domain_, node_, j * tile_cells + i, 0.5, 0.5);
        const double u = (node_.tile.key.i * double{tile_cells} + i + 0.5) / node_.half_cells - 1,
                     v = (node_.tile.key.j * double{tile_cells} + j + 0.5) / node_.half_cells - 1;
        const Vec3 p =
            domain_.is_plane()
                ? Vec3{u, v, gradients.height}
                : (1 + gradients.height) *
                      normalized(terrain::cube_point(terrain::cube_faces[node_.tile.key.face], u, v));
        return {times(p, radii_m_), normalized(times(gradients.smooth, inverse_radii_)),
                normalized(times(gradients.facet, inverse_radii_))};
    }
    [[nodiscard]] Vec3 scaled(Vec3 p) const { return times(p, inverse_radii_); }

private:
    const terrain::SurfaceDomain& domain_;
    const SurfaceNode& node_;
    Vec3 radii_m_, inverse_radii_;
};

} // namespace

SunSeen rounded_sun(Vec3 sun_m, double radius_m) {
    const double distance_m = length(sun_m);
    if (!(distance_m > radius_m)) return {};
    const terrain::CubeFace& face = terrain::cube_faces[terrain::cube_face_of(sun_m)];
    const double w = face.sign * terrain::component(sun_m, face.axis);
    const auto rounded = [&](int axis) {
        return sun_step_rad * std::nearbyint(terrain::component(sun_m, axis) / w / sun_step_rad);
    };
    // One part in 64 of the distance is one of the disc's width, and nothing of its direction.
    const double rounded_m = std::exp2(std::nearbyint(64 * std::log2(distance_m)) / 64);
    return {rounded_m * normalized(terrain::cube_point(face, rounded(face.u_axis), rounded(face.v_axis))),
            radius_m};
}

std::uint32_t SunTile::pack(Vec3 v) {
    const auto part = [](double x) {
        return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::nearbyint(511 * x))) & 0x3ffu;
    };
    return part(v.x) | part(v.y) << 10 | part(v.z) << 20;
}

std::size_t SunVisibility::slot_bytes() {
    return (sizeof(SunTile) + visibility_page_bytes - 1) / visibility_page_bytes * visibility_page_bytes;
}

SunVisibility::SunVisibility(const SurfaceTiles& tiles, std::size_t slots)
    : tiles_(tiles), slots_(slots + slots / 8) {
    void* const memory = mmap(nullptr, slots_ * slot_bytes(), PROT_READ | PROT_WRITE,
                              MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    arena_ = static_cast<std::byte*>(memory);
    madvise(arena_, slots_ * slot_bytes(), MADV_HUGEPAGE);
    for (std::size_t slot = slots_; slot > 0; --slot)
        free_.push_back(arena_ + (slot - 1) * slot_bytes());
}

SunVisibility::~SunVisibility() {
    for (const Retired& retired : retired_)
        give(retired.tile);
    munmap(arena_, slots_ * slot_bytes());
}

bool SunVisibility::keep_resident() const {
    const std::size_t bytes = slots_ * slot_bytes();
    if (mlock(arena_, bytes) == 0) return true;
    madvise(arena_, bytes, MADV_POPULATE_WRITE);
    return false;
}

/// With the mutex held, or without other threads.
void SunVisibility::give(const SunTile* tile) const {
    auto* const memory = reinterpret_cast<std::byte*>(const_cast<SunTile*>(tile));
    if (memory >= arena_ && memory < arena_ + slots_ * slot_bytes())
        free_.push_back(memory);
    else
        ::operator delete (memory, std::align_val_t{visibility_page_bytes});
}

void SunVisibility::release(SurfaceNode& node) const {
    const std::lock_guard lock(mutex_);
    for (std::atomic<const SunTile*>* const kept : {&node.sun, &node.sun_before})
        if (const SunTile* const tile = kept->load(std::memory_order_acquire)) give(tile);
}

void SunVisibility::retire(const SunTile* tile) const {
    const std::uint64_t epoch = tiles_.end_epoch();
    const std::lock_guard lock(mutex_);
    retired_.push_back({tile, epoch});
}

SunTile* SunVisibility::take(bool wait) const {
    const auto from_free = [&]() -> SunTile* {
        const std::lock_guard lock(mutex_);
        if (!retired_.empty()) {
            const std::uint64_t oldest = tiles_.oldest_pin();
            std::erase_if(retired_, [&](const Retired& r) {
                if (r.epoch >= oldest) return false;
                give(r.tile);
                return true;
            });
        }
        if (free_.empty()) return nullptr;
        std::byte* const memory = free_.back();
        free_.pop_back();
        return new (memory) SunTile;
    };
    if (SunTile* const tile = from_free()) return tile;
    // Reuse tiles of an earlier Sun that no frame in progress needs.
    const auto now = std::chrono::steady_clock::now();
    tiles_.for_each([&](SurfaceNode& node) {
        const SunTile* const newer = node.sun.load(std::memory_order_acquire);
        if (newer == nullptr || now - newer->made_at < max_frame) return;
        if (const SunTile* const old = node.sun_before.exchange(nullptr, std::memory_order_acq_rel))
            retire(old);
    });
    if (SunTile* const tile = from_free()) return tile;
    if (!wait) return nullptr;
    return new (::operator new (sizeof(SunTile), std::align_val_t{visibility_page_bytes})) SunTile;
}

bool SunVisibility::make(SurfaceNode& node, const SunSeen& sun, bool wait,
                         const std::function<bool()>& pause) const {
    const std::lock_guard one(making_[node.slot % stripes]);
    const SunTile* const old = node.sun.load(std::memory_order_acquire);
    if (old != nullptr && old->sun == sun) return true;
    // Frames that began before `old` was there take the one before it.
    if (!wait && old != nullptr && node.sun_before.load(std::memory_order_acquire) != nullptr &&
        std::chrono::steady_clock::now() - old->made_at < max_frame)
        return false;
    SunTile* const made = take(wait);
    if (made == nullptr) return false;
    made->sun = sun;
    try {
        if (!fill(node, *made, pause)) {
            const std::lock_guard lock(mutex_);
            give(made);
            return false;
        }
    } catch (...) {
        const std::lock_guard lock(mutex_);
        give(made);
        throw;
    }
    made_.fetch_add(1, std::memory_order_relaxed);
    made->made_at = std::chrono::steady_clock::now();
    made->born = tiles_.version() + 1;
    const SunTile* const before = node.sun_before.exchange(old, std::memory_order_acq_rel);
    node.sun.store(made, std::memory_order_release);
    node.wanted.fetch_and(~wanted_sun, std::memory_order_relaxed);
    if (before != nullptr) retire(before);
    return true;
}

const SunTile* SunVisibility::find(SurfaceNode& node, const DetailView& view, int& levels) const {
    levels = 0;
    if (view.wait) {
        for (;;) {
            const SunTile* const kept = node.sun.load(std::memory_order_acquire);
            if (kept != nullptr && kept->sun == view.sun) return kept;
            // Rows of another Sun may replace it again meanwhile.
            make(node, view.sun, true);
        }
    }
    for (SurfaceNode* at = &node; at != nullptr; at = at->parent, ++levels) {
        const SunTile* kept = at->sun.load(std::memory_order_acquire);
        const auto serves = [&] { return kept != nullptr && fresh(kept->sun, view.sun); };
        if (!serves() && (at->wanted.load(std::memory_order_relaxed) & wanted_sun) == 0)
            at->wanted.fetch_or(wanted_sun, std::memory_order_relaxed);
        if (kept != nullptr && kept->born > view.version)
            kept = at->sun_before.load(std::memory_order_acquire);
        if (view.counts != nullptr && at == &node && !serves()) ++view.counts->missed;
        if (kept != nullptr) return kept;
    }
    return nullptr;
}

bool SunVisibility::fill(const SurfaceNode& node, SunTile& out, const std::function<bool()>& pause) const {
    const terrain::SurfaceDomain& domain = tiles_.domain();
    const CellMiddles middles(domain, node);
    const scene::Sun disc{out.sun.centre_m, out.sun.radius_m};
    const double clear_m = 1e-10 * domain.unit_m();
    constexpr std::size_t edge = tile_cells / 2;
    std::vector<Vec3> sums(edge * edge);

    ScaledRays rays;
    rays.fixed_level = node.tile.key.level;
    RayPacket to_rocks; // the same rays in metres
    for (int i = 0; i < packet_size; ++i)
        rays.t_max[i] = to_rocks.t_max[i] = no_hit;
    constexpr std::uint32_t square = 4; // cells of a packet, each way
    for (std::uint32_t j0 = 0; j0 < tile_cells; j0 += square) {
        if (pause && !pause()) return false;
        for (std::uint32_t i0 = 0; i0 < tile_cells; i0 += square) {
            std::array<CellMiddles::Middle, packet_size> cells;
            Vec3s positions, direction;
            Doubles u, v, solid_angle;
            for (int k = 0; k < packet_size; ++k) {
                const std::uint32_t i = i0 + static_cast<std::uint32_t>(k) % square,
                                    j = j0 + static_cast<std::uint32_t>(k) / square;
                cells[static_cast<std::size_t>(k)] = middles.at(i, j);
                positions.set(k, cells[static_cast<std::size_t>(k)].position_m);
                std::tie(u[k], v[k]) = disc_point(node.tile.key, i, j);
            }
            sample_sun(positions, out.sun.centre_m, disc, u, v, direction, solid_angle);
            for (int k = 0; k < packet_size; ++k) {
                const CellMiddles::Middle& cell = cells[static_cast<std::size_t>(k)];
                const Vec3 to_sun = direction.lane(k);
                // Facets that face away shade themselves.
                rays.active.on[k] = dot(cell.smooth, to_sun) > 0 && dot(cell.facet, to_sun) > 0 ? -1 : 0;
                const Vec3 origin = cell.position_m + clear_m * cell.facet;
                rays.origin.set(k, middles.scaled(origin));
                rays.direction.set(k, middles.scaled(to_sun));
                to_rocks.origin.set(k, origin);
                to_rocks.direction.set(k, to_sun);
            }
            if (!rays.active.any()) continue;
            TileCrossings found;
            first_crossings(tiles_, rays, true, found);
            for (int k = 0; k < packet_size; ++k)
                rays.active.on[k] = found.t[k] == no_hit ? rays.active.on[k] : 0;
            if (rocks_ != nullptr && rays.active.any()) {
                to_rocks.active = rays.active;
                rocks_->occlude(to_rocks, rays);
                rays.active = to_rocks.active;
            }
            for (int k = 0; k < packet_size; ++k) {
                if (rays.active.on[k] == 0) continue;
                const std::size_t i = (i0 + static_cast<std::uint32_t>(k) % square) / 2,
                                  j = (j0 + static_cast<std::uint32_t>(k) / square) / 2;
                Vec3& sum = sums[j * edge + i];
                sum = sum + 0.25 * cells[static_cast<std::size_t>(k)].smooth;
            }
        }
    }
    std::size_t width = edge;
    for (int level = SunTile::first_level; level <= SunTile::last_level; ++level, width /= 2) {
        std::uint32_t* const texels = out.texels.data() + SunTile::offset(level);
        for (std::size_t k = 0; k < width * width; ++k)
            texels[k] = SunTile::pack(sums[k]);
        for (std::size_t j = 0; j < width / 2; ++j)
            for (std::size_t i = 0; i < width / 2; ++i) {
                const Vec3* const four = sums.data() + 2 * j * width + 2 * i;
                sums[j * (width / 2) + i] = 0.25 * (four[0] + four[1] + four[width] + four[width + 1]);
            }
    }
    return true;
}

} // namespace obscura::renderer
