// SPDX-License-Identifier: Apache-2.0
// Key times: fixed instants between which what rows share is interpolated.
#pragma once

#include "core/camera/frame.hpp"
#include "core/time.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

struct KeyTime {
    Time time;
    double weight = 1;
};

/// Chooses the key times of a row as a function of its exposure alone, so that neither the other rows of a
/// request nor the frame matter: rows at about the same time share them, in one frame or several.
///
/// Scene time is divided into intervals of a power of two of nanoseconds, 1.07 s to 0.5 ms, halved until the
/// image moves by no more than a given number of pixels within one, or sixteen fit into the exposure. Keys
/// are their ends, weighted by linear interpolation and the mean over the exposure; where next to nothing
/// moves, the middle alone.
///
/// With poses that are received at run time the only key is the last multiple of 4.2 ms before the row's
/// middle: later poses may not be known yet. Thread-bound.
class KeyTimes {
public:
    /// All arguments must outlive this. Motion is measured in the field and `reach_px` around it.
    KeyTimes(const scene::Scene& scene, const std::vector<BuiltBody>& bodies, const Projection& lens,
             double reach_px, double spacing_px);

    /// Fills `keys`; the weights sum to 1.
    void find(const RowTime& row, std::vector<KeyTime>& keys);
    /// Whether poses are received at run time: what was computed for a time may not hold in a later frame.
    [[nodiscard]] bool live() const { return live_; }

private:
    static constexpr int max_bits = 30, min_bits = 19, live_bits = 22;
    /// Motion in interval `index` of 2^bits ns, px.
    double motion(int bits, std::int64_t index);

    const scene::Scene& scene_;
    const std::vector<BuiltBody>& bodies_;
    const Projection& lens_;
    double reach_px_, spacing_px_;
    bool live_;
    struct Measured {
        bool known = false;
        std::int64_t index = 0;
        double motion_px = 0;
    };
    std::array<Measured, max_bits + 1> measured_; ///< last interval of each length
};

} // namespace obscura::renderer
