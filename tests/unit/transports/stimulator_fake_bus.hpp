// SPDX-License-Identifier: Apache-2.0
// A USB bus in memory with one GUD display on it that can be unplugged, held up and made to misbehave.
#pragma once

#include "core/error.hpp"
#include "tools/stimulator-sim/gud_device.hpp"
#include "transports/stimulator/usb.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

namespace obscura::test {

namespace gud = transports::gud;
using transports::UsbResult;
using transports::UsbStatus;

/// The bench: shared by the test and the device handles it hands out.
struct FakeBench {
    explicit FakeBench(tools::GudDeviceSettings settings) : display(std::move(settings)) {}

    std::mutex mutex; // of everything below
    tools::GudDevice display;
    bool plugged = true;
    bool hold = false; // transfers stay under way until this is false
    std::string serial = "FAKE-1";
    std::string problem;
    std::size_t open_handles = 0, in_flight = 0, max_in_flight = 0;
    std::uint64_t bulk_count = 0;
    /// Answers instead of the display when it returns something.
    std::function<std::optional<UsbResult>(std::uint8_t request, std::span<std::uint8_t> data)> on_control_in;
    std::function<std::optional<UsbResult>(std::uint8_t request)> on_control_out;
    std::function<std::optional<UsbResult>(std::uint64_t count)> on_bulk;

    void unplug() {
        const std::lock_guard lock(mutex);
        plugged = false;
        display.reset();
    }
    void plug() {
        const std::lock_guard lock(mutex);
        plugged = true;
    }
    template<typename F>
    auto with(F f) {
        const std::lock_guard lock(mutex);
        return f(*this);
    }
};

class FakeDevice final : public transports::UsbDevice {
public:
    explicit FakeDevice(std::shared_ptr<FakeBench> bench) : bench_(std::move(bench)) {
        ++bench_->open_handles;
    }
    ~FakeDevice() override {
        const std::lock_guard lock(bench_->mutex);
        for (const Transfer& t : transfers_)
            if (t.under_way) --bench_->in_flight;
        --bench_->open_handles;
    }
    UsbResult control_in(std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) override {
        const std::lock_guard lock(bench_->mutex);
        if (!bench_->plugged) return {UsbStatus::gone, 0};
        if (bench_->on_control_in)
            if (const auto answer = bench_->on_control_in(request, data)) return *answer;
        const auto answer = bench_->display.control_in(request, value, data.size(), 1000);
        if (!answer) return {UsbStatus::stall, 0};
        std::copy(answer->begin(), answer->end(), data.begin());
        return {UsbStatus::ok, answer->size()};
    }
    UsbResult control_out(std::uint8_t request, std::uint16_t value,
                          std::span<const std::uint8_t> data) override {
        const std::lock_guard lock(bench_->mutex);
        if (!bench_->plugged) return {UsbStatus::gone, 0};
        if (bench_->on_control_out)
            if (const auto answer = bench_->on_control_out(request)) return *answer;
        if (!bench_->display.knows_control_out(request)) return {UsbStatus::stall, 0};
        bench_->display.control_out(request, value, data);
        return {UsbStatus::ok, data.size()};
    }
    UsbStatus submit(std::size_t slot, std::span<const std::uint8_t> data) override {
        const std::lock_guard lock(bench_->mutex);
        if (!bench_->plugged) return UsbStatus::gone;
        Transfer& t = transfers_.at(slot);
        if (t.under_way) throw std::logic_error("slot is in use");
        t = {true, data};
        ++bench_->in_flight;
        bench_->max_in_flight = std::max(bench_->max_in_flight, bench_->in_flight);
        return UsbStatus::ok;
    }
    UsbResult wait(std::size_t slot, int wait_ms) override {
        for (int waited = 0;; ++waited) {
            {
                const std::lock_guard lock(bench_->mutex);
                Transfer& t = transfers_.at(slot);
                if (!t.under_way) return {UsbStatus::ok, 0};
                if (!bench_->plugged)
                    return end(t, {UsbStatus::error, t.data.size() / 3}); // as real buses do
                if (!bench_->hold) {
                    if (bench_->on_bulk)
                        if (const auto answer = bench_->on_bulk(bench_->bulk_count++)) return end(t, *answer);
                    const auto buffer = bench_->display.begin_bulk();
                    if (!buffer || !bench_->display.finish_bulk(*buffer, t.data, 1000))
                        return end(t, {UsbStatus::stall, 0});
                    return end(t, {UsbStatus::ok, t.data.size()});
                }
            }
            if (waited >= wait_ms) return {UsbStatus::pending, 0};
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    void cancel(std::size_t slot) override {
        const std::lock_guard lock(bench_->mutex);
        if (transfers_.at(slot).under_way) (void)end(transfers_.at(slot), {UsbStatus::timeout, 0});
    }
    UsbStatus clear_halt() override { return UsbStatus::ok; }
    [[nodiscard]] std::string description() const override { return "fake display"; }

private:
    struct Transfer {
        bool under_way = false;
        std::span<const std::uint8_t> data;
    };
    UsbResult end(Transfer& t, UsbResult result) {
        t.under_way = false;
        --bench_->in_flight;
        return result;
    }
    std::shared_ptr<FakeBench> bench_;
    std::array<Transfer, slots> transfers_;
};

class FakeBus final : public transports::UsbBus {
public:
    explicit FakeBus(std::shared_ptr<FakeBench> bench) : bench_(std::move(bench)) {}
    std::vector<transports::UsbIdentity> list(std::uint16_t vendor_id, std::uint16_t product_id) override {
        const std::lock_guard lock(bench_->mutex);
        if (!bench_->plugged || vendor_id != gud::default_vendor_id || product_id != gud::default_product_id)
            return {};
        return {{vendor_id, product_id, 1, 2, bench_->serial, bench_->problem}};
    }
    std::unique_ptr<transports::UsbDevice> open(const transports::UsbIdentity&) override {
        const std::lock_guard lock(bench_->mutex);
        if (!bench_->problem.empty())
            throw HardwareError("stimulator fake display: cannot be opened: " + bench_->problem);
        return std::make_unique<FakeDevice>(bench_);
    }

private:
    std::shared_ptr<FakeBench> bench_;
};

} // namespace obscura::test
