// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/outbox.hpp"

#include "service/compatible/codec.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::service::compatible {

Packet line_packet(std::string_view line) {
    return {encode({{"data", Bytes{std::string(line)}}})};
}

std::uint64_t Outbox::request_read() {
    answer_.reset();
    if (current_is_answer_ && sent_ == 0) drop_current();
    return ++read_;
}

void Outbox::add_line(std::string_view line, bool is_error) {
    if (lines_.size() < limits_.lines && left_out_ == 0) {
        lines_.push_back(line_packet(line));
        if (is_error) ++unread_errors_;
        return;
    }
    ++left_out_;
    error_left_out_ = error_left_out_ || is_error;
}

void Outbox::add_answer(std::uint64_t request, Packet answer, bool waits, bool failed,
                        Clock::time_point now) {
    const bool follows_error = unread_errors_ > 0;
    if (waits && follows_error) --unread_errors_;
    if (request != read_) return;
    answer_ = Answer{std::move(answer), waits, failed || (waits && follows_error), now + limits_.hold_ms};
}

const Packet* Outbox::next(Clock::time_point now) {
    if (current_) return &*current_;
    if (!lines_.empty()) {
        current_ = std::move(lines_.front());
        lines_.pop_front();
    } else if (left_out_ > 0) {
        current_ =
            line_packet(fmt::format("[{}] {} more lines", error_left_out_ ? "error" : "warning", left_out_));
        if (error_left_out_) ++unread_errors_;
        left_out_ = 0;
        error_left_out_ = false;
    } else if (ready(now)) {
        // A client that has waited for so long ignores errors, those before too.
        if (answer_->held && answer_->waits) unread_errors_ = 0;
        current_ = std::move(answer_->packet);
        current_is_answer_ = true;
        answer_.reset();
    } else {
        return nullptr;
    }
    return &*current_;
}

bool Outbox::ready(Clock::time_point now) const noexcept {
    return current_ || !lines_.empty() || left_out_ > 0 ||
           (answer_ && (!answer_->held || now >= answer_->until));
}

void Outbox::advance(std::size_t bytes) {
    sent_ += bytes;
    if (current_ && sent_ >= current_->size()) drop_current();
}

void Outbox::drop_current() {
    current_.reset();
    current_is_answer_ = false;
    sent_ = 0;
}

std::optional<Outbox::Clock::time_point> Outbox::due() const noexcept {
    if (answer_ && answer_->held) return answer_->until;
    return std::nullopt;
}

std::size_t Outbox::waiting() const noexcept {
    std::size_t bytes = current_ ? current_->size() - sent_ : 0;
    if (answer_) bytes += answer_->packet.size();
    for (const Packet& line : lines_)
        bytes += line.size();
    return bytes;
}

void Outbox::clear() {
    lines_.clear();
    left_out_ = 0;
    answer_.reset();
    drop_current();
}

} // namespace obscura::service::compatible
