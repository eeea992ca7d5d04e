// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/gpio_output.hpp"

#include "sync/inputs/gpio_line.hpp"

#include <cerrno>
#include <cstring>

namespace obscura::sync {
namespace {

#ifdef GPIOD_LINE_BULK_MAX_LINES // libgpiod 1.x

class GpioOutput final : public OutputLine {
public:
    GpioOutput(const std::string& key, const std::string& name, bool active_low)
        : place_(find_gpio_line(key, name)), line_(gpiod_chip_get_line(place_.chip.get(), place_.offset)) {
        const int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
        if (line_ == nullptr || gpiod_line_request_output_flags(line_, gpio_consumer, flags, 0) != 0)
            refuse_gpio_line(key, name, std::strerror(errno));
    }
    ~GpioOutput() override { gpiod_line_set_value(line_, 0); }
    bool set(bool active) noexcept override { return gpiod_line_set_value(line_, active ? 1 : 0) == 0; }

private:
    GpioLine place_; // its chip closes the line, too
    gpiod_line* line_;
};

#else // libgpiod 2.x

class GpioOutput final : public OutputLine {
public:
    GpioOutput(const std::string& key, const std::string& name, bool active_low) {
        const GpioLine place = find_gpio_line(key, name);
        offset_ = place.offset;
        const LineSettings line = new_line_settings();
        gpiod_line_settings_set_direction(line.get(), GPIOD_LINE_DIRECTION_OUTPUT);
        gpiod_line_settings_set_active_low(line.get(), active_low);
        gpiod_line_settings_set_output_value(line.get(), GPIOD_LINE_VALUE_INACTIVE);
        request_ = request_gpio_line(key, name, place, *line);
    }
    ~GpioOutput() override { GpioOutput::set(false); }
    bool set(bool active) noexcept override {
        return gpiod_line_request_set_value(request_.get(), offset_,
                                            active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) ==
               0;
    }

private:
    LineRequest request_;
    unsigned offset_ = 0;
};

#endif

} // namespace

std::unique_ptr<OutputLine> open_gpio_output(const std::string& key, const std::string& line,
                                             bool active_low) {
    return std::make_unique<GpioOutput>(key, line, active_low);
}

} // namespace obscura::sync
