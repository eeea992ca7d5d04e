// SPDX-License-Identifier: Apache-2.0
// Loader of a terrain's tiles: makes those that rays missed and those that the predicted camera will need.
#pragma once

#include "core/geometry.hpp"
#include "renderer/planets/surface_tiles.hpp"

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace obscura::renderer {

/// Where a terrain will be seen from: body frame.
struct PredictedView {
    Vec3 eye_m;
    Vec3 boresight;       ///< unit
    double field_rad = 0; ///< half angle of the field, with a margin
    double cell_rad = 0;  ///< see DetailView
    SunSeen sun;          ///< of terrains that keep its visibility

    bool operator==(const PredictedView&) const = default;
};

/// Makes tiles on a thread of its own, the coarsest first, and publishes each at once.
class TileLoader {
public:
    struct Settings {
        /// Tiles a second; 0: as many as it can. For tests and slow machines.
        double tiles_per_s = 0;
        /// Share of the arena that predicted tiles may take.
        double predicted_share = 0.75;
        /// Called first on the thread: sets its scheduling. Must not throw.
        std::function<void()> enter{};
        /// Share of a core that it takes at most while `busy` holds: it rests in proportion after every
        /// piece of work, of a few ms at most.
        double share = 1;
        std::function<bool()> busy{}; ///< whether threads that must not be kept waiting have work
    };

    /// Makes the pinned tiles, takes the arena's memory and starts the thread. `tiles` must outlive it.
    TileLoader(const SurfaceTiles& tiles, const Settings& settings);
    ~TileLoader();
    TileLoader(const TileLoader&) = delete;
    TileLoader& operator=(const TileLoader&) = delete;

    /// Where the next frames will be seen from. Real-time safe: neither blocks nor allocates; a prediction
    /// that comes while the thread reads the one before is dropped.
    void predict(const PredictedView& view) noexcept;

private:
    /// A tile to be made, or the visibility of the Sun in one.
    struct Request {
        SurfaceNode* parent;
        unsigned quarter;
        int level;
        bool wanted; ///< by a ray; else predicted
        double distance_m;
        bool sun = false; ///< of `parent`
    };

    void run();
    void collect();
    void add_predicted(const PredictedView& view);
    bool make(const Request& request);
    /// Rests after a piece of work; false: it is to stop.
    bool rest();

    const SurfaceTiles& tiles_;
    Settings settings_;
    std::vector<Request> requests_;
    std::optional<PredictedView> complete_;       ///< last view that lacked nothing
    std::chrono::steady_clock::time_point piece_; ///< beginning of the piece of work
    SunSeen sun_;                                 ///< for those
    std::mutex mutex_;                            ///< of what follows
    std::optional<PredictedView> predicted_;
    bool stop_ = false;
    std::condition_variable changed_;
    std::thread thread_;
};

} // namespace obscura::renderer
