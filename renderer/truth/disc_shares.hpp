// SPDX-License-Identifier: Apache-2.0
// Shares of a body's disc: how much of it a window shows, and how much of that nothing hides.
#pragma once

#include "renderer/truth/row_states.hpp"

#include <cstddef>

namespace obscura::renderer {

/// Share of a body's disc that is seen on a window's pixels, at one instant, and that without what hides it.
struct DiscShares {
    double seen = 0, inside = 0;
};

/// By rays over the disc of body `body` at `state`; all of it from inside the bounding sphere. Reentrant.
[[nodiscard]] DiscShares disc_shares(const TruthScene& scene, const RowStates& states, std::size_t body,
                                     std::size_t window, const TruthState& state);

} // namespace obscura::renderer
