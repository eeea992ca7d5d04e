// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a USB display that answers whatever it likes, set up and fed by the stimulator's link.
//
// Input: the answers to the control requests one after the other, each preceded by two bytes: how it ends (0
// ok, 1 stall, 2 time-out, 3 gone; modulo 5, the rest ok) and how many bytes follow at most.
#include "core/error.hpp"
#include "transports/stimulator/display_link.hpp"
#include "transports/stimulator/gud.hpp"

#include <algorithm>
#include <cstdlib>
#include <span>
#include <vector>

namespace {

using namespace obscura;
using namespace obscura::transports;

void require(bool truth) {
    if (!truth) std::abort();
}

class HostileDisplay final : public UsbDevice {
public:
    explicit HostileDisplay(std::span<const std::uint8_t> script) : script_(script) {}

    UsbResult control_in(std::uint8_t, std::uint16_t, std::span<std::uint8_t> data) override {
        const UsbStatus status = next_status();
        if (script_.empty()) return {status, 0};
        const std::size_t n = std::min({std::size_t{script_[0]} * 16, data.size(), script_.size() - 1});
        script_ = script_.subspan(1);
        std::copy_n(script_.begin(), n, data.begin());
        script_ = script_.subspan(n);
        return {status, n};
    }
    UsbResult control_out(std::uint8_t, std::uint16_t, std::span<const std::uint8_t> data) override {
        return {next_status(), data.size()};
    }
    UsbStatus submit(std::size_t slot, std::span<const std::uint8_t> data) override {
        require(slot < slots && !data.empty());
        return next_status();
    }
    UsbResult wait(std::size_t, int) override { return {next_status(), 0}; }
    void cancel(std::size_t) override {}
    UsbStatus clear_halt() override { return next_status(); }
    [[nodiscard]] std::string description() const override { return "hostile display"; }

private:
    UsbStatus next_status() {
        if (script_.empty()) return UsbStatus::stall;
        const std::uint8_t how = script_[0] % 5;
        script_ = script_.subspan(1);
        return how == 1   ? UsbStatus::stall
               : how == 2 ? UsbStatus::timeout
               : how == 3 ? UsbStatus::gone
                          : UsbStatus::ok;
    }
    std::span<const std::uint8_t> script_;
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    HostileDisplay display({data, size});
    try {
        DisplayLink link(display, {});
        // What was accepted must be something that can be worked with.
        require(link.width() > 0 && link.height() > 0);
        require(link.frame_bytes() > 0 && link.frame_bytes() <= gud::max_frame_bytes);
        const std::vector<std::uint8_t> row(static_cast<std::size_t>(link.width()) *
                                            static_cast<std::size_t>(gud::bytes_per_pixel(link.format())));
        require(link.whole_frames_only() || link.max_update_bytes() >= row.size());
        for (int i = 0; i < 3; ++i) {
            (void)link.send(0, {{0, i % link.height(), link.width(), 1}, row, false});
            (void)link.frame_status();
            (void)link.alive();
            link.resynchronise();
        }
        link.turn_off();
    } catch (const Error& error) {
        // One line for the log, without control characters of the display's.
        const std::string what = error.what();
        require(!what.empty() && what.find('\n') == std::string::npos);
    }
    return 0;
}
