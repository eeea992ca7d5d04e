// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/outbox.hpp"

#include "service/compatible/codec.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::service::compatible {
namespace {

/// Smaller packets are freed in no time.
constexpr std::size_t large_packet = 1 << 18;

} // namespace

Packet line_packet(std::string_view line) {
    return {encode({{"data", Bytes{std::string(line)}}})};
}

std::uint64_t Outbox::requests_read(std::size_t count) {
    const std::uint64_t first = read_ + 1;
    read_ += count;
    if (count == 0) return first;
    drop_answer();
    if (current_is_answer_ && sent_ == 0) drop_current();
    return first;
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
    if (request != read_) return spend(std::move(answer));
    drop_answer();
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

void Outbox::spend(Packet packet) {
    if (packet.size() >= large_packet) spent_.push_back(std::move(packet));
}

std::vector<Packet> Outbox::take_spent() {
    return std::exchange(spent_, {});
}

void Outbox::drop_answer() {
    if (answer_) spend(std::move(answer_->packet));
    answer_.reset();
}

void Outbox::drop_current() {
    if (current_) spend(std::move(*current_));
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
    drop_answer();
    drop_current();
}

} // namespace obscura::service::compatible
