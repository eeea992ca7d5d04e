// SPDX-License-Identifier: Apache-2.0
// Main program of obscura-stimulator-sim: reference device of the stimulator, a USB display (GUD) on
// FunctionFS.
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "emulator/version.hpp"
#include "host/command_line.hpp"
#include "host/interrupt.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/png.hpp"
#include "tools/stimulator-sim/functionfs.hpp"
#include "tools/stimulator-sim/usb_gadget.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cerrno>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace obscura;
using namespace obscura::tools;

constexpr const char* program = "obscura-stimulator-sim";
constexpr std::size_t max_gadget_name = 32; // FunctionFS takes 40 with its 'ffs.'

/// Writes the screen as PNG: R8 as 8 bits; colour formats as 16 bits, with red as the high and green as the
/// low byte, which is the exact level for grey coding high_low and the level times 257 for equal.
void save(const std::filesystem::path& file, const GudDevice& display) {
    const auto screen = display.screen();
    const GudDeviceSettings& s = display.settings();
    if (display.format() == gud::Format::r8) {
        images::write_png8(file, s.width, s.height, screen, {});
        return;
    }
    const auto pixel = static_cast<std::size_t>(gud::bytes_per_pixel(display.format()));
    std::vector<std::uint16_t> grey(screen.size() / pixel);
    for (std::size_t i = 0; i < grey.size(); ++i)
        grey[i] = static_cast<std::uint16_t>(screen[i * pixel + 2] << 8 | screen[i * pixel + 1]);
    images::write_png16(file, s.width, s.height, 16, grey, {});
}

std::uint32_t checksum(std::span<const std::uint8_t> bytes) {
    return static_cast<std::uint32_t>(::crc32(0, bytes.data(), static_cast<uInt>(bytes.size())));
}

class Simulator {
public:
    bool parse(const std::vector<std::string>& arguments) {
        host::CommandLine line;
        line.program = "obscura-";
        line.summary = "emulates a USB display (GUD), the reference device for the stimulator";
        line.description =
            "Makes this machine a USB device that speaks GUD (Generic USB Display), with a USB device controller or, without such hardware, the kernel's simulated one (modprobe dummy_hcd). "
            "Needs root and the kernel modules libcomposite and usb_f_fs. "
            "Prints a line for each update with the CRC-32 of its pixels and of the screen. "
            "Ends on SIGINT or SIGTERM.";
        line.option("--functionfs", &functionfs_, "DIR",
                    "Mount point of a FunctionFS instance to use (default: create a gadget)");
        line.option("--serial", &gadget_.serial, "TEXT", "Serial number of the gadget");
        line.option("--name", &gadget_.name, "NAME",
                    "Name of the gadget in configfs; each gadget needs its own name and controller");
        line.option("--controller", &gadget_.controller, "NAME",
                    "USB device controller, a name in /sys/class/udc (default: the first)");
        line.option("--size", &size_, "WxH", "Width and height of the screen in pixels");
        line.number("--refresh", &display_.refresh_hz, "HZ", "Refresh rate of the screen", 1, 1000);
        line.option("--format", &format_, "FORMAT", "Pixel format of the screen").choices = {"R8", "RGB888",
                                                                                             "XRGB8888"};
        line.flag("--full-update", display_.full_update, "Accept updates of the full frame only");
        line.flag("--no-lz4", no_lz4_, "Accept no compressed updates");
        line.flag("--plain", plain_, "Plain GUD: do not answer Obscura's frame status extension");
        line.number("--max-buffer", &display_.max_buffer_size, "BYTES",
                    "Largest update in bytes (0: a full frame)", 0, 1 << 26);
        line.option("--save", &save_, "DIR",
                    "Folder for the screen: screen.png and screen.raw at the end, and see --every");
        line.number("--every", &every_, "N",
                    "With --save: also write update_NNNNNN.png after every N-th update (0: never)", 0, 1e6);
        line.flag("-q,--quiet", quiet_, "Do not print a line for each update");
        line.examples = {"obscura-stimulator-sim --size 1280x1024 --save shown --every 1"};
        if (!line.parse("stimulator-sim", arguments)) return false;
        if (gadget_.name.empty() || gadget_.name.size() > max_gadget_name ||
            gadget_.name.find('/') != std::string::npos || gadget_.name.front() == '.')
            throw host::UsageError(fmt::format(
                "{}: --name: \"{}\", allowed 1 to {} characters without '/', the first of them no '.'",
                program, gadget_.name, max_gadget_name));
        std::int32_t width = 0, height = 0;
        host::parse_size(size_, width, height);
        if (width > static_cast<std::int32_t>(gud::max_dimension) ||
            height > static_cast<std::int32_t>(gud::max_dimension))
            throw host::UsageError(fmt::format("{}: --size: \"{}\", allowed up to {} a side", program, size_,
                                               gud::max_dimension));
        display_.width = static_cast<std::uint16_t>(width);
        display_.height = static_cast<std::uint16_t>(height);
        display_.formats = {format_ == "R8"       ? gud::Format::r8
                            : format_ == "RGB888" ? gud::Format::rgb888
                                                  : gud::Format::xrgb8888};
        display_.lz4 = !no_lz4_;
        display_.frame_status = !plain_;
        return true;
    }

    int run() {
        if (!save_.empty()) images::make_writable(save_);
        std::unique_ptr<UsbGadget> gadget;
        if (functionfs_.empty()) gadget = std::make_unique<UsbGadget>(gadget_);
        {
            FunctionFsDisplay device(gadget ? gadget->functionfs() : std::filesystem::path(functionfs_),
                                     display_);
            device.on_event = [](const std::string& line) { fmt::print("{}\n", line); };
            device.on_update = [this](const GudDevice& display, const GudUpdate& update) {
                note(display, update);
            };
            fmt::print("ready: {}x{} {}{}{}\n", display_.width, display_.height, format_,
                       display_.lz4 && !display_.full_update ? ", LZ4" : "",
                       display_.full_update ? ", whole frames" : "");
            if (gadget) gadget->bind();
            device.run(host::interrupted);
            device.with_display([this](const GudDevice& display) {
                fmt::print("end: {} updates, {} errors, screen crc {:08x}\n", display.status().received,
                           display.status().errors, checksum(display.screen()));
                if (save_.empty()) return;
                save(std::filesystem::path(save_) / "screen.png", display);
                std::ofstream raw(std::filesystem::path(save_) / "screen.raw", std::ios::binary);
                raw.write(reinterpret_cast<const char*>(display.screen().data()),
                          static_cast<std::streamsize>(display.screen().size()));
                if (!raw) throw OutputError(fmt::format("{}/screen.raw: cannot be written", save_), errno);
            });
            if (gadget) gadget->unbind();
        }
        return exit_ok;
    }

private:
    void note(const GudDevice& display, const GudUpdate& update) {
        ++updates_;
        const gud::SetBuffer& b = update.buffer;
        if (!quiet_)
            fmt::print("update {}: {}x{} at {},{} {} of {} bytes{} crc {:08x} screen {:08x}\n", updates_,
                       b.width, b.height, b.x, b.y, b.transfer_length(), b.length,
                       b.compression != 0 ? " LZ4" : "", checksum(update.pixels), checksum(display.screen()));
        if (!save_.empty() && every_ > 0 && updates_ % every_ == 0)
            save(std::filesystem::path(save_) / fmt::format("update_{:06}.png", updates_), display);
    }

    std::string functionfs_, size_ = "640x480", format_ = "R8", save_;
    bool no_lz4_ = false, plain_ = false, quiet_ = false;
    std::uint32_t every_ = 0;
    std::uint64_t updates_ = 0;
    GadgetSettings gadget_;
    GudDeviceSettings display_;
};

} // namespace

int main(int argc, char* argv[]) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0); // line buffered, so that a log shows each line at once
    try {
        if (argc == 2 && std::string_view(argv[1]) == "--version") {
            fmt::print("{} {}\n", program, emulator::version);
            return exit_ok;
        }
        Simulator simulator;
        if (!simulator.parse({argv + 1, argv + argc})) return exit_ok;
        host::catch_interrupts();
        return simulator.run();
    } catch (const Error& error) {
        print_message(error.what());
        return error.status();
    } catch (const std::exception& error) {
        print_message(fmt::format("{}: internal error: {}", program, error.what()));
        return exit_software;
    }
}
