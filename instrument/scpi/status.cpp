// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/status.hpp"

#include "instrument/scpi/text.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::instrument {
namespace {

/// The bit of the event register for the class of an error: its hundreds.
EventBit event_of(ScpiCode code) {
    switch (static_cast<int>(code) / 100) {
    case -1:
        return event_command_error;
    case -2:
        return event_execution_error;
    case -4:
        return event_query_error;
    default:
        return event_device_error;
    }
}

} // namespace

void Status::report(ScpiCode code, std::string detail) {
    set_event(event_of(code));
    if (queue_.size() < queue_length)
        queue_.push_back({code, std::move(detail)});
    else
        queue_.back() = {ScpiCode::queue_overflow, {}};
}

std::uint8_t Status::take_event() noexcept {
    return std::exchange(event_, std::uint8_t{0});
}

std::string Status::take_error() {
    Queued first{ScpiCode::no_error, {}};
    if (!queue_.empty()) {
        first = std::move(queue_.front());
        queue_.pop_front();
    }
    std::string text(name_of(first.code));
    if (!first.detail.empty()) text += ";" + first.detail;
    return fmt::format("{},{}", static_cast<int>(first.code), string_data(text.substr(0, max_text_bytes)));
}

std::uint8_t Status::status_byte(bool message_available) const noexcept {
    unsigned bits = 0;
    if (!queue_.empty()) bits |= 1U << 2;
    if (questionable.summary()) bits |= 1U << 3;
    if (message_available) bits |= 1U << 4;
    if ((event_ & event_enable) != 0) bits |= 1U << 5;
    if (operation.summary()) bits |= 1U << 7;
    if ((bits & service_enable) != 0) bits |= 1U << 6;
    return static_cast<std::uint8_t>(bits);
}

void Status::clear() noexcept {
    queue_.clear();
    event_ = 0;
    operation.event = questionable.event = 0;
}

} // namespace obscura::instrument
