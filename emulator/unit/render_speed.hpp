// SPDX-License-Identifier: Apache-2.0
// Rendering speed of this machine, measured at the start, and the reserve of time that follows from it.
#pragma once

#include "core/clock.hpp"
#include "renderer/renderer.hpp"

#include <cstdint>
#include <functional>
#include <optional>

namespace obscura::emulator {

/// Elapsed time that a frame takes at full quality, ns; extrapolated from its first parts where it takes more
/// than a few seconds. `frame` requests all rows. `go_on` is called several times a second with the
/// share that is done; none: it returned false.
[[nodiscard]] std::optional<std::int64_t> frame_time_ns(const renderer::Renderer& renderer,
                                                        const renderer::RenderRequest& frame,
                                                        const Clock& clock,
                                                        const std::function<bool(double)>& go_on);

/// By how much earlier than the detector needs it light is to be there, ns: what a slab of groups of rows
/// takes (a slab that takes twice as long as expected is still in time), no more than a tenth of the period,
/// no less than `at_least_ns`. `period_ns`: from one trigger to the next.
[[nodiscard]] std::int64_t reserve_for(std::int64_t frame_ns, std::int64_t period_ns,
                                       std::int64_t at_least_ns) noexcept;

} // namespace obscura::emulator
