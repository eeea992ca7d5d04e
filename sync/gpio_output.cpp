#include "sync/gpio_output.hpp"

#include "sync/gpio_line.hpp"

#include <cerrno>
#include <cstring>
#include <new>

namespace obscura::sync {
namespace {

constexpr const char* consumer = "obscura";

#ifdef GPIOD_LINE_BULK_MAX_LINES // libgpiod 1.x

class GpioOutput final : public OutputLine {
public:
    GpioOutput(const std::string& key, const std::string& name, bool active_low)
        : place_(find_gpio_line(key, name)), line_(gpiod_chip_get_line(place_.chip.get(), place_.offset)) {
        const int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
        if (line_ == nullptr || gpiod_line_request_output_flags(line_, consumer, flags, 0) != 0)
            refuse_gpio_line(key, name, std::strerror(errno));
    }
    ~GpioOutput() override { gpiod_line_set_value(line_, 0); }
    bool set(bool active) noexcept override { return gpiod_line_set_value(line_, active ? 1 : 0) == 0; }

private:
    GpioLine place_; // its chip closes the line, too
    gpiod_line* line_;
};

#else // libgpiod 2.x

template<auto Free>
struct FreeWith {
    template<typename T>
    void operator()(T* object) const {
        Free(object);
    }
};

class GpioOutput final : public OutputLine {
public:
    GpioOutput(const std::string& key, const std::string& name, bool active_low) {
        const GpioLine place = find_gpio_line(key, name);
        offset_ = place.offset;
        const std::unique_ptr<gpiod_line_settings, FreeWith<gpiod_line_settings_free>> line(
            gpiod_line_settings_new());
        const std::unique_ptr<gpiod_line_config, FreeWith<gpiod_line_config_free>> config(
            gpiod_line_config_new());
        const std::unique_ptr<gpiod_request_config, FreeWith<gpiod_request_config_free>> request(
            gpiod_request_config_new());
        if (!line || !config || !request) throw std::bad_alloc();
        gpiod_line_settings_set_direction(line.get(), GPIOD_LINE_DIRECTION_OUTPUT);
        gpiod_line_settings_set_active_low(line.get(), active_low);
        gpiod_line_settings_set_output_value(line.get(), GPIOD_LINE_VALUE_INACTIVE);
        gpiod_line_config_add_line_settings(config.get(), &offset_, 1, line.get());
        gpiod_request_config_set_consumer(request.get(), consumer);
        request_.reset(gpiod_chip_request_lines(place.chip.get(), request.get(), config.get()));
        if (!request_) refuse_gpio_line(key, name, std::strerror(errno));
    }
    ~GpioOutput() override { GpioOutput::set(false); }
    bool set(bool active) noexcept override {
        return gpiod_line_request_set_value(request_.get(), offset_,
                                            active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) ==
               0;
    }

private:
    std::unique_ptr<gpiod_line_request, FreeWith<gpiod_line_request_release>> request_;
    unsigned offset_ = 0;
};

#endif

} // namespace

std::unique_ptr<OutputLine> open_gpio_output(const std::string& key, const std::string& line,
                                             bool active_low) {
    return std::make_unique<GpioOutput>(key, line, active_low);
}

} // namespace obscura::sync
