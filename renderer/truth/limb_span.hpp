// SPDX-License-Identifier: Apache-2.0
// Part of a body's limb that can be in the field of a frame.
#pragma once

#include "renderer/truth/curves.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace obscura::renderer {

/// Azimuths of `points` points of the limb of a body, as near to each other as they can be where the field
/// is: the whole turn, with its first point again at the end, if most of it can be in the field, or the shape
/// is neither an ellipsoid nor a terrain; else the part that can. Empty: none can. The frame's rows are those
/// of `states`.
[[nodiscard]] std::optional<CurveSpan> limb_span(const TruthScene& scene, RowStates& states, std::size_t body,
                                                 std::uint32_t points);

} // namespace obscura::renderer
