// SPDX-License-Identifier: Apache-2.0
// Wing maps at the key times of the rows of a request, kept for the requests that follow.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/integrators/wing_map.hpp"
#include "renderer/world/key_times.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Chooses the maps that a row block needs, and adds their light to its rows. Thread-bound.
class WingMaps {
public:
    /// A map, and the sensor's rows for which it is needed.
    struct Needed {
        WingMap* map;
        std::int32_t first_y, last_y;
    };

    /// All arguments must outlive this.
    WingMaps(const Psf& psf, const WingKernels& kernels, KeyTimes key_times)
        : psf_(psf), kernels_(kernels), key_times_(key_times) {}

    /// Largest motion of the image between key times: the wings are smooth over a fraction of the core.
    static double spacing_px(const Psf& psf) { return psf.core_px() / 8; }

    /// The maps for the sensor's rows from `first_y`, each exposed at its own time, and the columns
    /// [first_x, first_x + width). They are to be filled before add().
    std::span<const Needed> find(std::uint64_t frame_id, std::span<const RowTime> rows, std::int32_t first_y,
                                 std::int32_t first_x, std::int32_t width);
    /// Adds the wings of row `r` of those to `light`, see WingMap::add().
    void add(std::size_t r, std::vector<double>& light, std::vector<float>& scratch) const;

private:
    /// Maps that are kept although the last request did not need them.
    static constexpr std::size_t kept = 6;

    struct Held {
        std::unique_ptr<WingMap> map;
        std::uint64_t used; ///< number of the last request that needed it
    };
    struct Share {
        const WingMap* map;
        double weight;
    };

    WingMap& map_at(Time time);

    const Psf& psf_;
    const WingKernels& kernels_;
    KeyTimes key_times_;
    std::vector<Held> held_;
    std::uint64_t request_ = 0, frame_id_ = 0;
    std::int32_t first_y_ = 0, first_x_ = 0, width_ = 0;
    std::vector<Needed> needed_;
    std::vector<Share> shares_;        ///< row by row
    std::vector<std::size_t> row_end_; ///< of each row's shares
    std::vector<KeyTime> keys_;
};

} // namespace obscura::renderer
