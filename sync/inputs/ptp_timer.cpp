// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/ptp_timer.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "sync/clock_reading.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace obscura::sync {

std::optional<Time> parse_start(const std::string& text) {
    const std::size_t point = std::min(text.find('.'), text.size());
    const std::string whole = text.substr(0, point);
    std::string fraction = point < text.size() ? text.substr(point + 1) : "";
    const auto digits = [](const std::string& part) {
        return std::all_of(part.begin(), part.end(), [](char c) { return c >= '0' && c <= '9'; });
    };
    if (whole.empty() || whole.size() > 10 || fraction.size() > 9 || !digits(whole) || !digits(fraction))
        return std::nullopt;
    fraction.resize(9, '0');
    const long long seconds = std::strtoll(whole.c_str(), nullptr, 10);
    if (seconds > 9'000'000'000) return std::nullopt;
    return Time{seconds * ns_per_s + std::strtoll(fraction.c_str(), nullptr, 10)};
}

ReadDifference open_ptp_clock(const std::string& table, const std::string& device) {
    const auto fd = std::make_shared<FileDescriptor>(::open(device.c_str(), O_RDONLY | O_CLOEXEC));
    if (!*fd) throw HardwareError(fmt::format("{}.device: {}: {}", table, device, std::strerror(errno)));
    const auto read = [fd]() -> std::optional<std::int64_t> {
        timespec t{};
        if (clock_gettime(clock_of_device(fd->get()), &t) != 0) return std::nullopt;
        return monotonic_minus(clock_of_device(fd->get()));
    };
    if (!read())
        throw HardwareError(fmt::format("{}.device: {}: no clock ({})", table, device, std::strerror(errno)));
    return read;
}

PtpTimer::PtpTimer(const PtpTimerSettings& settings, std::function<ReadDifference()> open,
                   std::unique_ptr<Clock> clock)
    : settings_(settings), open_(std::move(open)), clock_(std::move(clock)) {}

PtpTimer::~PtpTimer() {
    stop();
}

void PtpTimer::start(TriggerSink& sink) {
    stop();
    ReadDifference read = open_();
    const std::optional<std::int64_t> difference_ns = read();
    if (!difference_ns) throw HardwareError("ptp_timer: the clock cannot be read");
    stopping_ = false;
    missed_ = 0;
    steps_ = 0;
    clock_->rearm();
    thread_ = std::thread([this, &sink, read = std::move(read), first_ns = *difference_ns] {
        enter_thread(heartbeat_.name().c_str(), settings_.thread);
        declare_this_thread_realtime();
        run(sink, read, first_ns);
    });
}

void PtpTimer::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    clock_->interrupt();
    thread_.join();
    heartbeat_.rest();
    state_ = ClockState::free;
}

void PtpTimer::run(TriggerSink& sink, const ReadDifference& read, std::int64_t difference_ns) noexcept {
    Time now = clock_->now();
    const Time next_second{((now.ns - difference_ns) / ns_per_s + 1) * ns_per_s};
    const Schedule schedule(settings_.rate, settings_.start.value_or(next_second), settings_.phase_ns);
    std::uint64_t k = schedule.first_slot_from(Time{now.ns - difference_ns});
    std::uint64_t id_minus_slot = 1; // grows when slots repeat after a backward step
    Time read_last = now;
    ClockState state = ClockState::locked;
    while (!stopping_.load(std::memory_order_relaxed)) {
        heartbeat_.beat();
        now = clock_->now();
        if (const std::optional<std::int64_t> reading = read()) {
            const std::int64_t change_ns = *reading - difference_ns;
            difference_ns = *reading;
            read_last = now;
            state = ClockState::locked;
            if (std::llabs(change_ns) > settings_.step_ns) {
                steps_.fetch_add(1, std::memory_order_relaxed);
                state = ClockState::free;
                // Continue after the slot of this instant, which may have been delivered already.
                const std::uint64_t slot = schedule.first_slot_from(Time{now.ns - difference_ns + 1});
                if (slot < k)
                    id_minus_slot += k - slot; // backward step: the ids continue
                else
                    missed_.fetch_add(slot - k, std::memory_order_relaxed);
                k = slot;
            }
        } else {
            state = now - read_last > settings_.holdover_ns ? ClockState::free : ClockState::holdover;
        }
        state_.store(state, std::memory_order_relaxed);
        const Time due = schedule.slot(k) + difference_ns;
        if (now < due) {
            clock_->sleep_until(std::min(due, now + Heartbeat::max_wait_ns));
            continue; // read the other clock again for the slot's time stamp
        }
        // At least slot k is due; of all due slots deliver the last and count the others as missed.
        const std::uint64_t last =
            std::max(k, schedule.first_slot_from(Time{now.ns + 1 - difference_ns}) - 1);
        missed_.fetch_add(last - k, std::memory_order_relaxed);
        sink.on_trigger({.id = last + id_minus_slot,
                         .edge = schedule.slot(last) + difference_ns,
                         .seen = now,
                         .clock = state,
                         .next = schedule.slot(last + 1) + difference_ns});
        k = last + 1;
    }
}

} // namespace obscura::sync
