// SPDX-License-Identifier: Apache-2.0
// Name of a GPIO line in a configuration: the line's own name, or chip and offset.
#pragma once

#include <string>

namespace obscura::sync {

struct GpioLineName {
    /// Name of the line in the kernel or device tree; empty: the line is given by chip and offset.
    std::string name{};
    std::string device{}; ///< of the chip, "/dev/gpiochip0"
    unsigned offset = 0;
};

/// Parses "TRIG_IN", "gpiochip0:3" or "/dev/gpiochip0:3". Checks the text only, not the hardware. Throws
/// std::invalid_argument with the text, the cause and what is allowed.
[[nodiscard]] GpioLineName parse_gpio_line(const std::string& text);

} // namespace obscura::sync
