// SPDX-License-Identifier: Apache-2.0
// GPIO lines through libgpiod 1 or 2: search by name or offset, and requests.
#pragma once

#include <gpiod.h>

#include <cstddef>
#include <memory>
#include <string>

namespace obscura::sync {

struct CloseGpioChip {
    void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using GpioChip = std::unique_ptr<gpiod_chip, CloseGpioChip>;

/// Consumer name that the kernel shows for lines requested here.
inline constexpr const char* gpio_consumer = "obscura";

/// A line of an open chip.
struct GpioLine {
    GpioChip chip;
    unsigned offset = 0;
    std::string device; ///< of the chip
};

/// Opens the chip of `line`, written as parse_gpio_line() accepts it. Throws ConfigError that names `key` for
/// invalid text, HardwareError as refuse_gpio_line() does for a line that does not exist.
[[nodiscard]] GpioLine find_gpio_line(const std::string& key, const std::string& line);

/// Throws HardwareError: `key`: GPIO line "`line`": `why`; allowed is ...
[[noreturn]] void refuse_gpio_line(const std::string& key, const std::string& line, const std::string& why);

#ifndef GPIOD_LINE_BULK_MAX_LINES // libgpiod 2.x

template<auto Free>
struct FreeWith {
    template<typename T>
    void operator()(T* object) const {
        Free(object);
    }
};
using LineSettings = std::unique_ptr<gpiod_line_settings, FreeWith<gpiod_line_settings_free>>;
using LineRequest = std::unique_ptr<gpiod_line_request, FreeWith<gpiod_line_request_release>>;

/// Throws std::bad_alloc.
[[nodiscard]] LineSettings new_line_settings();

/// Requests the line from the kernel; `key` and `name` are for messages. `buffered_events`: capacity of the
/// kernel's queue of edges (0: its default). Throws HardwareError as refuse_gpio_line() does.
[[nodiscard]] LineRequest request_gpio_line(const std::string& key, const std::string& name,
                                            const GpioLine& line, gpiod_line_settings& settings,
                                            std::size_t buffered_events = 0);

#endif

} // namespace obscura::sync
