// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/settings.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "transports/stimulator/calibration_table.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/stimulator_output.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

namespace obscura::transports {
namespace {

void check_black(const StimulatorSettings& s, double white_dn, const config::ReadTable& table) {
    if (s.black_dn >= white_dn)
        table.refuse("black_dn", fmt::format("{} is not below white at {}", s.black_dn, white_dn));
}

/// Calibration table of an enabled stimulator; nullopt if it has none or it cannot be read (then reported).
std::optional<CalibrationTable> read_table(const StimulatorSettings& s, const config::ReadTable& table) {
    if (!s.enabled || s.calibration.empty()) return std::nullopt;
    if (!is_file_at(s.calibration)) {
        table.refuse("calibration", fmt::format("{} is no file that can be read", s.calibration));
        return std::nullopt;
    }
    try {
        return read_calibration(s.calibration);
    } catch (const InputError& error) {
        table.refuse("calibration", error.what());
        return std::nullopt;
    }
}

void check(StimulatorSettings& s, const config::ReadTable& table) {
    if (!s.calibration.empty()) s.calibration = absolute_path(s.calibration).string();
    const bool colours = s.format == DisplayFormat::rgb888 || s.format == DisplayFormat::xrgb8888;
    if (s.grey != GreyCoding::equal && !colours)
        table.refuse("grey",
                     fmt::format("\"{}\" needs a format with colours, RGB888 or XRGB8888", name_of(s.grey)));
    if (s.white_dn > 0) check_black(s, s.white_dn, table);
    (void)read_table(s, table);
}

} // namespace

std::optional<gud::Format> gud_format(DisplayFormat format) {
    switch (format) {
    case DisplayFormat::automatic:
        break;
    case DisplayFormat::r8:
        return gud::Format::r8;
    case DisplayFormat::rgb888:
        return gud::Format::rgb888;
    case DisplayFormat::xrgb8888:
        return gud::Format::xrgb8888;
    }
    return std::nullopt;
}

double white_level_dn(const StimulatorSettings& s, int adc_bits) {
    return s.white_dn > 0 ? s.white_dn : std::exp2(adc_bits) - 1;
}

config::Section section_of(StimulatorSettings& s) {
    using config::key;
    return {
        .name = StimulatorSettings::kind,
        .help = "Transport that shows every frame on a USB display (GUD) in front of a real camera.",
        .keys =
            {
                key("enabled", &s.enabled)
                    .help("Show every frame on a USB display (GUD) in front of a real camera"),
                key("vendor_id", &s.vendor_id).range(0, 65535).help("USB vendor number of the display"),
                key("product_id", &s.product_id).range(0, 65535).help("USB product number of the display"),
                key("serial", &s.serial)
                    .help("USB serial number of the display; empty: the first display found"),
                key("width", &s.width)
                    .unit("px")
                    .range(0, 16384)
                    .help("Width of the display mode; 0: the display's preferred mode"),
                key("height", &s.height)
                    .unit("px")
                    .range(0, 16384)
                    .help("Height of the display mode; 0: the display's preferred mode"),
                key("refresh_hz", &s.refresh_hz)
                    .unit("Hz")
                    .range(0, 10000)
                    .help("Refresh rate of the display mode; 0: the display's preferred mode"),
                key("format", &s.format)
                    .help(
                        "Pixel format on the USB link; auto: the first of R8, XRGB8888, RGB888 that the display has"),
                key("grey", &s.grey)
                    .help("Grey coding in the channels of a colour format; "
                          "equal: the same level in all (256 levels); sum: levels that add up (766); "
                          "high_low: high byte in red, low byte in green (65536)"),
                key("compression", &s.compression)
                    .help("LZ4 compression where the display supports it; auto: when it saves time"),
                key("queue_frames", &s.queue_frames)
                    .range(1, 64)
                    .help("Frames that may wait for the display; further ones are dropped and counted"),
                key("calibration", config::Path{&s.calibration, false, true})
                    .help("Calibration file written by obscura stimulator calibrate; "
                          "empty: one camera pixel per screen pixel, linear screen"),
                key("black_dn", &s.black_dn)
                    .unit("DN")
                    .range(-65536, 65535)
                    .help("Digital number that means no light"),
                key("white_dn", &s.white_dn)
                    .unit("DN")
                    .range(0, 65536)
                    .help("Digital number that means the peak luminance; 0: the highest of the ADC"),
                key("peak", &s.peak)
                    .range(0, 1)
                    .help("Luminance for white_dn, relative to the brightest point of the screen; "
                          "0: the maximum luminance of its darkest point, so that white is uniform"),
                key("dither", &s.dither)
                    .help(
                        "Dithering of fractional drive levels: none, over 16x16 pixels, over 256 frames, or over both"),
            },
        .check = [&s](const config::ReadTable& table) { check(s, table); },
    };
}

void check_against(const StimulatorSettings& s, const CameraFacts& camera, const config::ReadTable& table) {
    const SensorFacts& sensor = camera.sensor;
    check_black(s, white_level_dn(s, sensor.adc_bits), table);
    const auto calibration = read_table(s, table);
    if (!calibration) return;
    if (calibration->camera_width != sensor.width || calibration->camera_height != sensor.height)
        table.refuse("calibration", fmt::format("made with a camera of {}x{} pixels, the sensor has {}x{}",
                                                calibration->camera_width, calibration->camera_height,
                                                sensor.width, sensor.height));
}

std::vector<Identity> identities_of(const StimulatorSettings& s) {
    return {{"serial", s.serial, s.serial, "stimulator"}};
}

std::size_t frames_held_by(const StimulatorSettings& s) {
    return s.queue_frames + 1;
}

std::unique_ptr<Transport> make_transport(const StimulatorSettings& s, const TransportContext& context) {
    return std::make_unique<StimulatorOutput>(
        s, StimulatorContext{.sensor = context.sensor, .thread = context.display}, make_libusb_bus());
}

} // namespace obscura::transports
