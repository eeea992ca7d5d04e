// SPDX-License-Identifier: Apache-2.0
// GPIO output lines for status signals of the camera, through libgpiod.
#pragma once

#include <memory>
#include <string>

namespace obscura::sync {

/// An output line. Inactive after construction; set inactive on destruction.
class OutputLine {
public:
    virtual ~OutputLine() = default;
    /// Sets the level. Returns false when the line has vanished. Neither allocates nor throws.
    virtual bool set(bool active) noexcept = 0;
};

/// Requests `line` (see parse_gpio_line()) for output; `key` is its configuration key, for messages. Throws
/// as find_gpio_line() does.
[[nodiscard]] std::unique_ptr<OutputLine> open_gpio_output(const std::string& key, const std::string& line,
                                                           bool active_low);

} // namespace obscura::sync
