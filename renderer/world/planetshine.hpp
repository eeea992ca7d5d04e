// SPDX-License-Identifier: Apache-2.0
// Planetshine: the sunlit bodies that light others, selected per row.
#pragma once

#include "renderer/world/row_state.hpp"

namespace obscura::renderer {

/// Sets BodyState::planetshine: for each body those others with the largest estimated irradiance. Bodies
/// whose bounding spheres meet, as parts of a spacecraft do, are left out, as are those that fill so much of
/// the sky that random directions find them. Does not allocate.
void find_planetshine(RowState& row);

} // namespace obscura::renderer
