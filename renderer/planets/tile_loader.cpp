// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_loader.hpp"

#include "renderer/planets/sun_visibility.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <tuple>

namespace obscura::renderer {
namespace {

using namespace std::chrono_literals;

/// How long the thread sleeps between two looks for missing tiles.
constexpr auto interval = 2ms;
/// Shorter pieces of work are not worth a rest.
constexpr auto min_piece = 500us;
/// Tiles made between two looks: a missing coarse tile does not wait for many fine ones.
constexpr std::size_t max_batch = 16;

/// Whether any of the tile's surface can be seen: not behind the limb of the least sphere, and within the
/// field or near the eye.
bool in_view(const SurfaceTiles& tiles, const SurfaceNode& node, const PredictedView& view) {
    const Vec3 to_tile = node.centre_m - view.eye_m;
    const double distance_m = length(to_tile);
    if (distance_m <= 2 * node.radius_m) return true;
    const double beside = std::acos(std::clamp(dot(to_tile, view.boresight) / distance_m, -1.0, 1.0));
    if (beside > view.field_rad + std::asin(std::min(1.0, 1.1 * node.radius_m / distance_m))) return false;
    const terrain::SurfaceDomain& domain = tiles.domain();
    if (domain.is_plane()) return true;
    // In scaled space: beyond the tangent from the eye, raised by the highest mountains at both ends.
    const Vec3 radii = domain.radii_m();
    const auto scaled = [&](Vec3 p) { return Vec3{p.x / radii.x, p.y / radii.y, p.z / radii.z}; };
    const Vec3 eye = scaled(view.eye_m), place = scaled(node.centre_m);
    const double low = 1 + tiles.least(), high = 1 + tiles.largest();
    const double horizon = std::acos(std::min(1.0, low / length(eye))) + std::acos(std::min(1.0, low / high));
    const double angle = std::acos(std::clamp(dot(eye, place) / (length(eye) * length(place)), -1.0, 1.0));
    const double min_radius = std::min({radii.x, radii.y, radii.z});
    return angle < horizon + 1.1 * node.radius_m / min_radius;
}

} // namespace

TileLoader::TileLoader(const SurfaceTiles& tiles, const Settings& settings)
    : tiles_(tiles), settings_(settings) {
    tiles_.keep_resident();
    tiles_.make_pinned();
    tiles_.publish();
    thread_ = std::thread([this] { run(); });
}

TileLoader::~TileLoader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void TileLoader::predict(const PredictedView& view) noexcept {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) predicted_ = view;
}

void TileLoader::add_predicted(const PredictedView& view) {
    const auto most =
        static_cast<std::size_t>(settings_.predicted_share * static_cast<double>(tiles_.usage().slots));
    const DetailView detail{.eye_m = view.eye_m, .cell_rad = view.cell_rad};
    // The finest level that samples take: their random number close to 1.
    const LevelChoice levels{&detail, 2 / view.cell_rad, 0};
    std::vector<SurfaceNode*> row, next;
    for (std::size_t face = 0; face < tiles_.domain().faces(); ++face)
        row.push_back(tiles_.root(face));
    std::size_t seen = 0;
    while (!row.empty() && seen < most) {
        next.clear();
        for (SurfaceNode* const node : row) {
            if (!levels.splits(*node) || !in_view(tiles_, *node, view)) continue;
            for (unsigned quarter = 0; quarter < 4 && seen < most; ++quarter) {
                ++seen;
                // Counts as used, so that it stays.
                SurfaceNode* const child = tiles_.made(*node, quarter);
                if (child != nullptr)
                    next.push_back(child);
                else
                    requests_.push_back({node, quarter, node->tile.key.level + 1, false,
                                         length(node->centre_m - view.eye_m)});
            }
        }
        row.swap(next);
    }
}

void TileLoader::collect() {
    requests_.clear();
    tiles_.take_wanted([&](SurfaceNode& node, std::uint32_t bits) {
        for (unsigned quarter = 0; quarter < 4; ++quarter)
            if ((bits >> quarter & 1u) != 0 && node.child[quarter].load(std::memory_order_relaxed) == nullptr)
                requests_.push_back({&node, quarter, node.tile.key.level + 1, true, 0});
        // Where the surface itself is coarse, its shadows are too.
        if ((bits & wanted_sun) != 0) requests_.push_back({&node, 0, node.tile.key.level + 1, true, 0, true});
    });
    std::optional<PredictedView> view;
    {
        const std::lock_guard lock(mutex_);
        view = predicted_;
    }
    if (!view) std::erase_if(requests_, [](const Request& r) { return r.sun; });
    sun_ = view ? view->sun : SunSeen{};
    if (requests_.size() < max_batch && view && complete_ != view) {
        const std::size_t wanted = requests_.size();
        add_predicted(*view);
        // Until it moves, or what it needs has gone again and rays miss it.
        if (requests_.size() == wanted) complete_ = view;
    }
    const std::size_t count = std::min(requests_.size(), max_batch);
    std::partial_sort(requests_.begin(), requests_.begin() + static_cast<std::ptrdiff_t>(count),
                      requests_.end(), [](const Request& a, const Request& b) {
                          return std::tuple(!a.wanted, a.level, a.distance_m) <
                                 std::tuple(!b.wanted, b.level, b.distance_m);
                      });
    // The others are wanted again by the next rays that miss them.
    requests_.resize(count);
}

bool TileLoader::make(const Request& request) {
    try {
        if (request.sun)
            tiles_.sun_visibility()->make(*request.parent, sun_, false, [this] { return rest(); });
        else
            tiles_.make_child(*request.parent, request.quarter);
        tiles_.publish();
        return true;
    } catch (const std::exception&) {
        return false; // a source that cannot be read now: the coarser tile stays
    }
}

bool TileLoader::rest() {
    const auto now = std::chrono::steady_clock::now();
    const auto worked = now - piece_;
    if (worked < min_piece) return true;
    const auto rested =
        now + std::chrono::duration_cast<std::chrono::nanoseconds>(worked * (1 / settings_.share - 1));
    std::unique_lock lock(mutex_);
    while (!stop_ && settings_.busy && settings_.busy() && std::chrono::steady_clock::now() < rested)
        changed_.wait_until(lock, std::min(rested, std::chrono::steady_clock::now() + interval));
    piece_ = std::chrono::steady_clock::now();
    return !stop_;
}

void TileLoader::run() {
    pthread_setname_np(pthread_self(), "tiles");
    if (settings_.enter) settings_.enter();
    auto next = std::chrono::steady_clock::now();
    for (;;) {
        SurfaceTiles::Pin pin = tiles_.pin();
        piece_ = std::chrono::steady_clock::now();
        collect();
        if (!rest()) return;
        for (const Request& request : requests_) {
            piece_ = std::chrono::steady_clock::now();
            make(request);
            if (!rest()) return;
            if (!(settings_.tiles_per_s > 0)) continue;
            next = std::max(next, std::chrono::steady_clock::now() - 1s) +
                   std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / settings_.tiles_per_s));
            std::unique_lock lock(mutex_);
            if (changed_.wait_until(lock, next, [&] { return stop_; })) return;
        }
        std::unique_lock lock(mutex_);
        if (stop_) return;
        if (requests_.empty() && changed_.wait_for(lock, interval, [&] { return stop_; })) return;
    }
}

} // namespace obscura::renderer
