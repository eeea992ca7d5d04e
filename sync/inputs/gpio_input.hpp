// SPDX-License-Identifier: Apache-2.0
// Edge input on a GPIO line, through libgpiod.
#pragma once

#include "core/text/enum_names.hpp"
#include "sync/edge_input.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace obscura::sync {

/// Edge detection of a GPIO line.
enum class GpioEdge : std::uint8_t { rising, falling, both };
constexpr auto enum_names(GpioEdge /*type*/) {
    return std::array{EnumName{GpioEdge::rising, "rising"}, EnumName{GpioEdge::falling, "falling"},
                      EnumName{GpioEdge::both, "both"}};
}

struct GpioSettings {
    std::string table = "trigger"; ///< of the configuration, for messages
    std::string line;              ///< see parse_gpio_line()
    GpioEdge edge = GpioEdge::rising;
    /// Debounced by the kernel with libgpiod 2, by Conditioner with libgpiod 1.
    std::int64_t debounce_ns = 0;

    [[nodiscard]] std::string key() const { return table + ".line"; }
};

/// Opens the line for input. Time stamps are the kernel's (CLOCK_MONOTONIC, taken in the interrupt). Sequence
/// numbers come from the kernel with libgpiod 2; with 1.6 lost edges are detected only when both edges are
/// enabled and two of the same kind follow each other. Throws HardwareError naming the line and the cause.
[[nodiscard]] std::unique_ptr<EdgeInput> open_gpio(const GpioSettings& settings);

} // namespace obscura::sync
