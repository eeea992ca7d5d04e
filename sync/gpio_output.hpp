// A GPIO line that tells others what is going on here.
#pragma once

#include <memory>
#include <string>

namespace obscura::sync {

/// Inactive when made, and when it goes.
class OutputLine {
public:
    virtual ~OutputLine() = default;
    /// False when the line has gone. Neither allocates nor throws.
    virtual bool set(bool active) noexcept = 0;
};

/// Requests the line (name or "gpiochipN:OFFSET") for output. `key` is what messages call it. Throws
/// HardwareError naming the line and what is wrong.
[[nodiscard]] std::unique_ptr<OutputLine> open_gpio_output(const std::string& key, const std::string& line,
                                                           bool active_low);

} // namespace obscura::sync
