// Finds a GPIO line by what a configuration calls it, with either version of libgpiod.
#pragma once

#include <gpiod.h>

#include <memory>
#include <string>

namespace obscura::sync {

struct CloseGpioChip {
    void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using GpioChip = std::unique_ptr<gpiod_chip, CloseGpioChip>;

/// A line of a chip that is open.
struct GpioLine {
    GpioChip chip;
    unsigned offset = 0;
    std::string device; ///< of the chip
};

/// `line` is a line's name or "gpiochipN:OFFSET". Throws HardwareError as refuse_gpio_line() does.
[[nodiscard]] GpioLine find_gpio_line(const std::string& key, const std::string& line);

/// Throws HardwareError: `key`: GPIO line "`line`": `why`; allowed is ...
[[noreturn]] void refuse_gpio_line(const std::string& key, const std::string& line, const std::string& why);

} // namespace obscura::sync
