// Edges of a GPIO line, through libgpiod.
#pragma once

#include "sync/edge_input.hpp"

#include <memory>
#include <string>

namespace obscura::sync {

enum class GpioEdge : std::uint8_t { rising, falling, both };

struct GpioSettings {
    std::string line; ///< a line's name ("TRIG_IN") or chip and offset ("gpiochip0:3")
    GpioEdge edge = GpioEdge::rising;
    std::int64_t debounce_ns = 0; ///< in the kernel where libgpiod can ask for it (2.x); else see Conditioner
};

/// Opens the line for input. Stamps are the kernel's (CLOCK_MONOTONIC, taken in the interrupt). Sequence
/// numbers come from the kernel with libgpiod 2; with 1.6 lost edges show only when both edges are watched
/// and two of a kind follow each other. Throws HardwareError naming the line and what is wrong.
[[nodiscard]] std::unique_ptr<EdgeInput> open_gpio(const GpioSettings& settings);

} // namespace obscura::sync
