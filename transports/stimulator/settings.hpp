// Settings of the stimulator transport: section [stimulator], its checks and its maker.
#pragma once

#include "core/enum_names.hpp"
#include "core/realtime.hpp"
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

/// LZ4, where the device takes it: never, when it saves time on this link, whenever it saves bytes.
enum class Compression : std::uint8_t { off, automatic, always };
/// Names in the configuration.
constexpr auto enum_names(Compression /*type*/) {
    return std::array{EnumName{Compression::automatic, "auto"}, EnumName{Compression::off, "off"},
                      EnumName{Compression::always, "always"}};
}

/// Pixel formats that can be asked of a display; automatic: the first one of R8, XRGB8888, RGB888 that it
/// has.
enum class DisplayFormat : std::uint8_t { automatic, r8, rgb888, xrgb8888 };
/// As gud::to_string() names them.
constexpr auto enum_names(DisplayFormat /*type*/) {
    return std::array{EnumName{DisplayFormat::automatic, "auto"}, EnumName{DisplayFormat::r8, "R8"},
                      EnumName{DisplayFormat::rgb888, "RGB888"},
                      EnumName{DisplayFormat::xrgb8888, "XRGB8888"}};
}
/// Nothing for automatic.
[[nodiscard]] std::optional<gud::Format> gud_format(DisplayFormat format);

/// Section [stimulator]: which display to use, how to drive it, and what its pictures stand for.
struct StimulatorSettings {
    static constexpr std::string_view kind = "stimulator";

    bool enabled = false;
    std::uint32_t vendor_id = gud::default_vendor_id;   ///< 16 bits
    std::uint32_t product_id = gud::default_product_id; ///< 16 bits
    std::string serial;                                 ///< empty: the first device found
    std::int32_t width = 0, height = 0;                 ///< of the mode; 0: what the device prefers
    double refresh_hz = 0;                              ///< of the mode; 0: what the device prefers
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

/// What a stimulator is made from besides its settings.
struct StimulatorContext {
    SensorFacts sensor{.adc_bits = 16};
    ThreadSettings thread{};
    std::int64_t look_ns = 40 * ns_per_ms;       ///< between looks for a device that is not there
    std::int64_t reconnect_ns = 200 * ns_per_ms; ///< between attempts to set one up that is
};

/// The digital number that means `peak` with an ADC of `adc_bits`.
[[nodiscard]] double white_level_dn(const StimulatorSettings& settings, int adc_bits);

/// A relative calibration file starts from the folder of the configuration file. The check reads it.
[[nodiscard]] config::Section section_of(StimulatorSettings& settings);
/// Black below white, and a calibration made for this sensor.
void check_against(const StimulatorSettings& settings, const SensorFacts& sensor,
                   const config::ReadTable& table);
/// The serial number of the display.
[[nodiscard]] std::vector<Identity> identities_of(const StimulatorSettings& settings);
/// The queue and the frame in work.
[[nodiscard]] std::size_t frames_held_by(const StimulatorSettings& settings);
/// A StimulatorOutput on libusb, not started.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const StimulatorSettings& settings,
                                                        const TransportContext& context);

} // namespace obscura::transports
