// SPDX-License-Identifier: Apache-2.0
// Verb `obscura stimulator`: USB displays (GUD), test patterns, calibration of screen and camera.
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "images/image.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/png.hpp"
#include "tools/check/report.hpp"
#include "tools/verbs/verb.hpp"
#include "transports/stimulator/calibrate.hpp"
#include "transports/stimulator/display_link.hpp"
#include "transports/stimulator/grey.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/patterns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <thread>

namespace obscura::tools {
namespace {

namespace fs = std::filesystem;
using transports::PatternSequence;

class Stimulator final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "finds USB displays, shows test patterns, calibrates screen and camera";
        line.description =
            "The action list prints the connected USB displays that speak GUD (Generic USB Display). patterns writes the test patterns of a calibration as PNG. show displays them one after the other, or a single one with --pattern. calibrate reads the camera's image of each pattern, NAME.png or NAME.fits with the pattern's name, and writes the table for the key stimulator.calibration. "
            "An additional image named dark, taken with the screen off, separates the black level of the screen from that of the camera. "
            "All images must be linear in light and taken with the same exposure, without saturation.";
        line.positional("ACTION", &action_, "What to do").choices = {"list", "patterns", "show", "calibrate"};
        line.option("--size", &size_, "WxH",
                    "With patterns and calibrate: width and height of the screen in pixels");
        line.option("--grey", &grey_, "CODING",
                    "Grey coding of the display: equal has 256 levels, sum 766, high_low 65536")
            .choices = {"equal", "sum", "high_low"};
        line.number("--ramp", &ramp_, "N", "Number of steps of the grey ramp", 2, 4096);
        line.number("--dot-step", &dot_step_, "PX", "Pitch of the dot grid in screen pixels", 8, 1024);
        line.option("--captures", &captures_, "DIR", "With calibrate: folder with the camera's images");
        line.number("--saturation", &saturation_, "DN",
                    "With calibrate: digital number at which the camera saturates", 1, 65535);
        line.option(
            "-o,--output", &output_, "PATH",
            "With patterns: folder for the PNG files; with calibrate: calibration file to write (FITS)");
        line.option("--pattern", &pattern_, "NAME", "With show: display only the pattern of this name");
        line.number("--seconds", &seconds_, "S", "With show: seconds for which each pattern is displayed", 0,
                    86400);
        line.option("--serial", &serial_, "TEXT",
                    "With show: serial number of the display (default: the first display found)");
        line.flag("--json", json_, "With calibrate: print the results as one JSON object");
        line.examples = {"obscura stimulator list",
                         "obscura stimulator patterns --size 1280x1024 -o patterns",
                         "obscura stimulator show --seconds 2",
                         "obscura stimulator calibrate --size 1280x1024 --captures captures -o bench.fits"};
    }

    int run() override {
        if (action_ == "list") return list();
        if (action_ == "show") return show();
        if (output_.empty())
            throw host::UsageError(fmt::format("obscura stimulator {}: --output is missing", action_));
        if (size_.empty())
            throw host::UsageError(fmt::format("obscura stimulator {}: --size is missing", action_));
        std::int32_t width = 0, height = 0;
        host::parse_size(size_, width, height);
        if (width < 16 || height < 16 || width > 16384 || height > 16384)
            throw host::UsageError(
                fmt::format("obscura stimulator: --size: \"{}\", allowed 16 to 16384 a side", size_));
        const int levels = grey_ == "equal" ? 256 : grey_ == "sum" ? 766 : 65536;
        const PatternSequence sequence(width, height, levels, ramp_, dot_step_);
        return action_ == "patterns" ? patterns(sequence) : calibrate(sequence);
    }

private:
    static int list() {
        const auto bus = transports::make_libusb_bus();
        const auto found = bus->list(transports::gud::default_vendor_id, transports::gud::default_product_id);
        for (const transports::UsbIdentity& d : found)
            fmt::print("{:04x}:{:04x} bus {} address {} serial {}{}{}\n", d.vendor_id, d.product_id, d.bus,
                       d.address, d.serial.empty() ? "-" : d.serial, d.problem.empty() ? "" : ": ",
                       d.problem);
        if (found.empty()) print_message("obscura stimulator: no GUD display is connected");
        return found.empty() ? exit_hardware : exit_ok;
    }

    int patterns(const PatternSequence& sequence) const {
        std::error_code error;
        fs::create_directories(output_, error);
        images::require_writable(output_);
        for (const transports::Pattern& pattern : sequence.patterns()) {
            if (host::interrupted()) return exit_failure;
            const auto picture = sequence.draw(pattern);
            const fs::path file = fs::path(output_) / (pattern.name + ".png");
            if (sequence.levels() == 256)
                images::write_png8(file, sequence.width(), sequence.height(),
                                   std::vector<std::uint8_t>(picture.begin(), picture.end()), {});
            else
                images::write_png16(file, sequence.width(), sequence.height(), 16, picture, {});
        }
        fmt::print("{}: {} pictures\n", output_, sequence.patterns().size());
        return exit_ok;
    }

    int show() const {
        const auto bus = transports::make_libusb_bus();
        std::optional<transports::UsbIdentity> chosen;
        for (const auto& d :
             bus->list(transports::gud::default_vendor_id, transports::gud::default_product_id))
            if (!chosen && (serial_.empty() || d.serial == serial_)) chosen = d;
        if (!chosen)
            throw HardwareError(
                "obscura stimulator: no such display is connected (try: obscura stimulator list)");
        const auto device = bus->open(*chosen);
        transports::DisplayWish wish;
        if (grey_ != "equal") wish.format = transports::gud::Format::xrgb8888;
        transports::DisplayLink link(*device, wish);
        const transports::GreyCoding grey = enum_named<transports::GreyCoding>(grey_).value();
        const PatternSequence sequence(link.width(), link.height(),
                                       transports::grey_levels(link.format(), grey), ramp_, dot_step_);
        bool any = false;
        for (const transports::Pattern& pattern : sequence.patterns()) {
            if (host::interrupted() || (!pattern_.empty() && pattern.name != pattern_)) continue;
            any = true;
            send(*device, link, grey, sequence.draw(pattern));
            fmt::print("{}\n", pattern.name);
            std::fflush(stdout);
            const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds_);
            while (!host::interrupted() && std::chrono::steady_clock::now() < end)
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        if (!any && !host::interrupted())
            throw host::UsageError(fmt::format(
                "obscura stimulator: there is no pattern \"{}\" (obscura stimulator patterns writes them all)",
                pattern_.substr(0, 60)));
        return exit_ok;
    }

    /// Sends a full picture in updates no larger than the display accepts. Throws HardwareError.
    static void send(transports::UsbDevice& device, transports::DisplayLink& link,
                     transports::GreyCoding grey, const std::vector<std::uint16_t>& levels) {
        std::vector<std::uint8_t> bytes(link.frame_bytes());
        transports::pack_levels(link.format(), grey, levels, bytes);
        const std::size_t stride = bytes.size() / static_cast<std::size_t>(link.height());
        const auto rows = static_cast<std::int32_t>(
            std::min<std::size_t>(link.max_update_bytes() / stride, static_cast<std::size_t>(link.height())));
        for (std::int32_t y = 0; y < link.height(); y += rows) {
            const std::int32_t n = std::min(rows, link.height() - y);
            const transports::DisplayUpdate update{
                {0, y, link.width(), n},
                std::span(bytes).subspan(static_cast<std::size_t>(y) * stride,
                                         static_cast<std::size_t>(n) * stride),
                false};
            transports::UsbStatus status = link.send(0, update);
            if (status == transports::UsbStatus::ok) status = device.wait(0, 5000).status;
            if (status != transports::UsbStatus::ok)
                throw HardwareError(
                    fmt::format("stimulator {}: {}", device.description(), transports::to_string(status)));
        }
    }

    int calibrate(const PatternSequence& sequence) const {
        if (captures_.empty()) throw host::UsageError("obscura stimulator calibrate: --captures is missing");
        std::map<std::string, std::optional<transports::Capture>> read;
        const auto capture = [&](const std::string& name) -> const transports::Capture* {
            const auto [place, fresh] = read.try_emplace(name);
            if (fresh)
                for (const char* ending : {".fits", ".png"})
                    if (const fs::path file = fs::path(captures_) / (name + ending); path_exists(file)) {
                        const images::Image image = images::read_image(file);
                        place->second =
                            transports::Capture{image.width, image.height,
                                                std::vector<float>(image.values.begin(), image.values.end())};
                        break;
                    }
            return place->second ? &*place->second : nullptr;
        };
        transports::CalibrationSettings settings;
        settings.saturation = saturation_;
        transports::CalibrationReport found;
        const transports::CalibrationTable table = transports::calibrate(sequence, capture, settings, found);
        transports::write_calibration(output_, table);
        Report report;
        report.add("seen_percent", "camera pixels that see the screen", found.seen_percent, "%", 1);
        report.add("camera_per_screen", "camera pixels per screen pixel", found.camera_per_screen, "", 3);
        report.add("finest_column_stripe", "finest columns resolved (px)",
                   std::int64_t{found.finest_column_stripe});
        report.add("finest_row_stripe", "finest rows resolved (px)", std::int64_t{found.finest_row_stripe});
        report.add("dots_used", "dots used", std::int64_t{found.dots_used});
        report.add("dots_rejected", "dots rejected", std::int64_t{found.dots_rejected});
        report.add("homography_rms_px", "dot residual, homography, rms", found.homography_rms_px, "px", 3);
        report.add("residual_rms_px", "dot residual, distortion map, rms", found.residual_rms_px, "px", 3);
        report.add("uniformity_min", "lowest uniformity", found.uniformity_min, "", 3);
        report.add("black_to_white", "black over white", found.black_to_white, "", 5);
        report.add("dead_pixels_resolved", "single screen pixels resolved", found.dead_pixels_resolved);
        report.add("dead_pixels", "dead screen pixels", static_cast<std::int64_t>(table.dead.size()));
        report.print(json_);
        return exit_ok;
    }

    std::string action_, size_, grey_ = "equal", captures_, output_, pattern_, serial_;
    std::int32_t ramp_ = 33, dot_step_ = 40;
    double saturation_ = 65535, seconds_ = 1;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_stimulator() {
    return std::make_unique<Stimulator>();
}

} // namespace obscura::tools
