// SPDX-License-Identifier: Apache-2.0
// Settings of the stimulator transport: section [stimulator], its checks and its maker.
#pragma once

#include "core/realtime/realtime.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"
#include "transports/stimulator/dither.hpp"
#include "transports/stimulator/grey.hpp"
#include "transports/stimulator/gud.hpp"
#include "transports/transport_settings.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports {

/// Use of LZ4 on devices that support it: never, when it saves time on this link, or when it saves bytes.
enum class Compression : std::uint8_t { off, automatic, always };
/// Names in the configuration.
constexpr auto enum_names(Compression /*type*/) {
    return std::array{EnumName{Compression::automatic, "auto"}, EnumName{Compression::off, "off"},
                      EnumName{Compression::always, "always"}};
}

/// Pixel formats of a display; automatic: the first of R8, XRGB8888, RGB888 that it supports.
enum class DisplayFormat : std::uint8_t { automatic, r8, rgb888, xrgb8888 };
/// Names in the configuration, equal to those of gud::to_string().
constexpr auto enum_names(DisplayFormat /*type*/) {
    return std::array{EnumName{DisplayFormat::automatic, "auto"}, EnumName{DisplayFormat::r8, "R8"},
                      EnumName{DisplayFormat::rgb888, "RGB888"},
                      EnumName{DisplayFormat::xrgb8888, "XRGB8888"}};
}
/// GUD format; nullopt for automatic.
[[nodiscard]] std::optional<gud::Format> gud_format(DisplayFormat format);

/// Section [stimulator]: display, its mode and grey coding, and the scale from digital numbers to luminance.
struct StimulatorSettings {
    static constexpr std::string_view kind = "stimulator";

    bool enabled = false;
    std::uint32_t vendor_id = gud::default_vendor_id;   ///< 16 bits
    std::uint32_t product_id = gud::default_product_id; ///< 16 bits
    std::string serial;                                 ///< empty: the first device found
    std::int32_t width = 0, height = 0;                 ///< display mode; 0: the device's preferred mode
    double refresh_hz = 0;                              ///< display mode; 0: the device's preferred mode
    DisplayFormat format = DisplayFormat::automatic;
    GreyCoding grey = GreyCoding::equal;
    Compression compression = Compression::automatic;
    std::size_t queue_frames = 2; ///< frames that may wait; further ones are dropped and counted
    std::string calibration;      ///< empty: pixel for pixel, linear
    double black_dn = 0;          ///< digital number that means no light
    double white_dn = 0;          ///< digital number that means `peak`; 0: the highest of the ADC
    double peak = 0;              ///< see OpticalSettings
    Dither dither = Dither::both;
};

/// Resources of a stimulator besides its settings.
struct StimulatorContext {
    SensorFacts sensor{.adc_bits = 16};
    ThreadSettings thread{};
    std::int64_t look_ns = 40 * ns_per_ms;       ///< interval of scans for a missing device
    std::int64_t reconnect_ns = 200 * ns_per_ms; ///< interval of attempts to set up a connected device
};

/// Digital number that means `peak` with an ADC of `adc_bits`.
[[nodiscard]] double white_level_dn(const StimulatorSettings& settings, int adc_bits);

/// Section bound to `settings`. A relative path of the calibration file is resolved from the folder of the
/// configuration file; the check reads the file.
[[nodiscard]] config::Section section_of(StimulatorSettings& settings);
/// Checks that black is below white, and that the calibration was made for this sensor's size.
void check_against(const StimulatorSettings& settings, const CameraFacts& camera,
                   const config::ReadTable& table);
/// The serial number of the display: two cameras must not use the same.
[[nodiscard]] std::vector<Identity> identities_of(const StimulatorSettings& settings);
/// Capacity of the queue, plus the frame in progress.
[[nodiscard]] std::size_t frames_held_by(const StimulatorSettings& settings);
/// A StimulatorOutput on libusb, not started.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const StimulatorSettings& settings,
                                                        const TransportContext& context);

} // namespace obscura::transports
