// SPDX-License-Identifier: Apache-2.0
// Scheduling class of the threads that render: the renderer's workers and the pipeline thread.
#pragma once

#include "core/realtime/realtime.hpp"
#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::emulator {

/// Scheduling class of Linux, see sched(7).
enum class RenderClass : std::uint8_t {
    other, ///< like any program, at a nice level
    batch, ///< the same, and in longer time slices
    rr,    ///< before every ordinary program; threads take turns
    fifo,  ///< before every ordinary program; a thread runs until it waits
};
constexpr auto enum_names(RenderClass /*type*/) {
    return std::array{EnumName{RenderClass::other, "other"}, EnumName{RenderClass::batch, "batch"},
                      EnumName{RenderClass::rr, "rr"}, EnumName{RenderClass::fifo, "fifo"}};
}

/// Default: as the process was started, on any core.
struct RenderScheduling {
    RenderClass policy = RenderClass::other;
    int nice = 0;     ///< with other and batch; 0: as the process was started
    int priority = 0; ///< with rr and fifo, 1..98
    CoreSet cores{};  ///< of the workers; empty: any core
    double share = 1; ///< of its time that each of these threads is at work at most, see RenderRest

    [[nodiscard]] bool has_priority() const noexcept {
        return policy == RenderClass::rr || policy == RenderClass::fifo;
    }
    [[nodiscard]] bool operator==(const RenderScheduling&) const noexcept = default;
};

/// Puts the calling thread into the class; leaves its cores.
RealtimeGrant schedule_this_thread(const RenderScheduling& wanted) noexcept;
/// Whether this process may have threads of that class; changes nothing.
[[nodiscard]] RealtimeGrant scheduling_permitted(const RenderScheduling& wanted) noexcept;
/// Sets name, class and cores of the calling worker thread, as far as granted. Cheap when repeated.
void enter_render_worker(const RenderScheduling& wanted) noexcept;

} // namespace obscura::emulator
