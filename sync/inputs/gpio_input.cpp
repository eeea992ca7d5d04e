// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/gpio_input.hpp"

#include "sync/inputs/gpio_line.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>

namespace obscura::sync {
namespace {

#ifdef GPIOD_LINE_BULK_MAX_LINES // libgpiod 1.x

class GpioInput final : public EdgeInput {
public:
    explicit GpioInput(const GpioSettings& settings)
        : place_(find_gpio_line(settings.key(), settings.line)),
          line_(gpiod_chip_get_line(place_.chip.get(), place_.offset)),
          both_(settings.edge == GpioEdge::both) {
        const auto request = settings.edge == GpioEdge::rising    ? gpiod_line_request_rising_edge_events
                             : settings.edge == GpioEdge::falling ? gpiod_line_request_falling_edge_events
                                                                  : gpiod_line_request_both_edges_events;
        if (line_ == nullptr || request(line_, gpio_consumer) != 0)
            refuse_gpio_line(settings.key(), settings.line, std::strerror(errno));
    }

    int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept override {
        const timespec limit{timeout_ns / ns_per_s, timeout_ns % ns_per_s};
        const int ready = gpiod_line_event_wait(line_, &limit);
        // Check the device node: unplugging a chip does not end the wait (Linux 6.1).
        if (ready == 0) return ::access(place_.device.c_str(), F_OK) == 0 ? 0 : gone;
        if (ready < 0) return errno == EINTR ? 0 : gone;
        std::array<gpiod_line_event, 16> events;
        const int count = gpiod_line_event_read_multiple(
            line_, events.data(), static_cast<unsigned>(std::min(events.size(), edges.size())));
        if (count < 0) return errno == EINTR || errno == EAGAIN ? 0 : gone;
        for (int i = 0; i < count; ++i) {
            const gpiod_line_event& event = events[static_cast<std::size_t>(i)];
            edges[static_cast<std::size_t>(i)] = {Time{event.ts.tv_sec * ns_per_s + event.ts.tv_nsec},
                                                  sequence_of(event.event_type),
                                                  event.event_type == GPIOD_LINE_EVENT_FALLING_EDGE};
        }
        return count;
    }

private:
    // Two edges of the same kind in a row: the one between them was lost.
    std::uint64_t sequence_of(int kind) noexcept {
        if (!both_) return 0;
        sequence_ += kind == last_kind_ ? 2 : 1;
        last_kind_ = kind;
        return sequence_;
    }

    GpioLine place_; // its chip closes the line, too
    gpiod_line* line_ = nullptr;
    const bool both_;
    int last_kind_ = 0;
    std::uint64_t sequence_ = 0;
};

#else // libgpiod 2.x

using EventBuffer = std::unique_ptr<gpiod_edge_event_buffer, FreeWith<gpiod_edge_event_buffer_free>>;

class GpioInput final : public EdgeInput {
public:
    explicit GpioInput(const GpioSettings& settings) : buffer_(gpiod_edge_event_buffer_new(16)) {
        const GpioLine place = find_gpio_line(settings.key(), settings.line);
        device_ = place.device;
        if (!buffer_) throw std::bad_alloc();
        const LineSettings line = new_line_settings();
        gpiod_line_settings_set_direction(line.get(), GPIOD_LINE_DIRECTION_INPUT);
        gpiod_line_settings_set_edge_detection(line.get(),
                                               settings.edge == GpioEdge::rising    ? GPIOD_LINE_EDGE_RISING
                                               : settings.edge == GpioEdge::falling ? GPIOD_LINE_EDGE_FALLING
                                                                                    : GPIOD_LINE_EDGE_BOTH);
        gpiod_line_settings_set_event_clock(line.get(), GPIOD_LINE_CLOCK_MONOTONIC);
        gpiod_line_settings_set_debounce_period_us(line.get(),
                                                   static_cast<unsigned long>(settings.debounce_ns / 1000));
        request_ = request_gpio_line(settings.key(), settings.line, place, *line, 256);
    }

    int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept override {
        const int ready = gpiod_line_request_wait_edge_events(request_.get(), timeout_ns);
        if (ready == 0) return ::access(device_.c_str(), F_OK) == 0 ? 0 : gone;
        if (ready < 0) return errno == EINTR ? 0 : gone;
        const int count = gpiod_line_request_read_edge_events(request_.get(), buffer_.get(),
                                                              std::min<std::size_t>(16, edges.size()));
        if (count < 0) return errno == EINTR || errno == EAGAIN ? 0 : gone;
        for (int i = 0; i < count; ++i) {
            gpiod_edge_event* event =
                gpiod_edge_event_buffer_get_event(buffer_.get(), static_cast<unsigned long>(i));
            edges[static_cast<std::size_t>(i)] = {
                Time{static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event))},
                gpiod_edge_event_get_line_seqno(event),
                gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_FALLING_EDGE};
        }
        return count;
    }

private:
    EventBuffer buffer_;
    LineRequest request_;
    std::string device_;
};

#endif

} // namespace

std::unique_ptr<EdgeInput> open_gpio(const GpioSettings& settings) {
    return std::make_unique<GpioInput>(settings);
}

} // namespace obscura::sync
