// The part of Device that bins: what a client may choose, and what becomes of the region then.
#include "transports/gige/device/device.hpp"
#include "transports/gige/device/device_words.hpp"

#include <algorithm>
#include <type_traits>

namespace obscura::transports::gige {
namespace {

/// `at` and `length` in whole binned pixels within `pixels`, as near as can be to what they are.
void fit(std::int32_t& at, std::int32_t& length, std::int32_t pixels, const BinnedExtent& e,
         std::int32_t binning) {
    const std::int32_t step = e.step * binning;
    length = std::clamp(length / step * step, e.minimum * binning, e.maximum * binning);
    at = std::max(0, std::min(at, pixels - length) / step * step);
}

} // namespace

Status Device::write_binning(const Binning& wanted) {
    const auto possible = [](std::int32_t n) { return n == 1 || n == 2 || n == 4; };
    if (!possible(wanted.horizontal) || !possible(wanted.vertical)) return Status::invalid_parameter;
    const BinnedExtent x =
        binned_extent(limits_.sensor_width, limits_.width_min, limits_.width_step, wanted.horizontal);
    const BinnedExtent y =
        binned_extent(limits_.sensor_height, limits_.height_min, limits_.height_step, wanted.vertical);
    if (x.maximum < x.minimum || y.maximum < y.minimum) return Status::invalid_parameter; // a tiny sensor
    CameraSettings s = control_.settings();
    const bool multipart = (bank_.peek(reg::stream_configuration) & sccfg::multipart) != 0;
    if (wanted.active() && (multipart || s.more_count > 0 || s.sampling == Sampling::non_destructive))
        return Status::write_protect;
    if (wanted.active()) {
        fit(s.region.x, s.region.width, limits_.sensor_width, x, wanted.horizontal);
        fit(s.region.y, s.region.height, limits_.sensor_height, y, wanted.vertical);
        if (!control_.explain(s).empty() || !control_.apply(s)) return Status::invalid_parameter;
    }
    binning_ = wanted;
    return Status::success;
}

void Device::add_binning() {
    const auto extent = [this](bool wide) {
        return wide ? binned_extent(limits_.sensor_width, limits_.width_min, limits_.width_step,
                                    binning_.horizontal)
                    : binned_extent(limits_.sensor_height, limits_.height_min, limits_.height_step,
                                    binning_.vertical);
    };
    const auto limit = [&](std::string_view name, std::uint32_t address, bool wide,
                           std::int32_t BinnedExtent::*member) {
        word(name, address, 0,
             [extent, wide, member] { return static_cast<std::uint32_t>(extent(wide).*member); });
    };
    limit("WidthMin", feature::width_min, true, &BinnedExtent::minimum);
    limit("WidthMax", feature::width_max, true, &BinnedExtent::maximum);
    limit("WidthStep", feature::width_step, true, &BinnedExtent::step);
    limit("HeightMin", feature::height_min, false, &BinnedExtent::minimum);
    limit("HeightMax", feature::height_max, false, &BinnedExtent::maximum);
    limit("HeightStep", feature::height_step, false, &BinnedExtent::step);

    const auto part = [&](std::string_view name, std::uint32_t address, std::uint32_t minimum,
                          std::uint32_t maximum, auto Binning::*member) {
        bank_.add({.name = name,
                   .address = address,
                   .access = Access::read_write,
                   .locked_while_streaming = true,
                   .minimum = minimum,
                   .maximum = maximum,
                   .read = [this, member] { return static_cast<std::uint32_t>(binning_.*member); },
                   .write =
                       [this, member](std::uint32_t value) {
                           Binning wanted = binning_;
                           wanted.*member = static_cast<std::decay_t<decltype(wanted.*member)>>(value);
                           return write_binning(wanted);
                       }});
    };
    part("BinningHorizontal", feature::binning_horizontal, 1, 4, &Binning::horizontal);
    part("BinningVertical", feature::binning_vertical, 1, 4, &Binning::vertical);
    part("BinningHorizontalMode", feature::binning_horizontal_mode, 0, 1, &Binning::horizontal_mode);
    part("BinningVerticalMode", feature::binning_vertical_mode, 0, 1, &Binning::vertical_mode);
}

} // namespace obscura::transports::gige
