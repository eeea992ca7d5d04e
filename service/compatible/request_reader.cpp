// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/request_reader.hpp"

#include <algorithm>
#include <utility>

namespace obscura::service::compatible {
namespace {

/// Bytes that are read at a time, whose memory is counted before.
constexpr std::size_t step_bytes = 1 << 16;
/// Memory of a value at most, and so of what a byte of a message becomes: a value is of 5 bytes or more, and
/// lists have room for twice their values while they grow.
constexpr std::size_t value_bytes = 2 * sizeof(Value), byte_bytes = value_bytes / 5 + 1;
/// Memory of a message that is not counted.
constexpr std::size_t small_bytes = 1 << 12;

std::uint64_t memory_of(std::size_t values, std::size_t bytes) {
    return bytes + values * value_bytes;
}

} // namespace

std::string name_in(const Fields& message) {
    const Value* const name = find(message, "");
    const auto* const text = name == nullptr ? nullptr : name->as<std::string>();
    return text == nullptr ? std::string() : *text;
}

bool ends_with_close(std::string_view bytes) {
    static const std::string close = encode({{"", "close"}});
    return bytes.ends_with(close);
}

bool RequestReader::has_room() const noexcept {
    return waiting.size() < limits_.requests && waiting_bytes_ < limits_.request_bytes;
}

void RequestReader::add(std::string bytes) {
    unread_ = true;
    if (input_.empty())
        input_ = std::move(bytes);
    else
        input_ += bytes;
}

std::size_t RequestReader::read() {
    const std::size_t before = waiting.size();
    std::size_t at = 0, end = std::min(input_.size(), step_bytes);
    while (!closed_ && has_room()) {
        const std::uint64_t now = memory_of(decoder_.values(), input_.size() - at + decoder_.bytes());
        // An item that was not complete is one value at most: new ones come of the bytes of a step.
        if (now > small_bytes) memory_.resize(share_, now + step_bytes * byte_bytes);
        at += decoder_.read(std::string_view(input_).substr(at, end - at));
        if (decoder_.complete()) {
            take_message();
        } else if (end < input_.size()) {
            end = std::min(input_.size(), end + step_bytes);
        } else {
            unread_ = false;
            break;
        }
    }
    input_.erase(0, at);
    if (closed_) input_.clear();
    if (input_.empty()) unread_ = false;
    if (!unread_ && !begun()) share_ = {};
    if (input_.capacity() > 4 * step_bytes && input_.size() < step_bytes) input_.shrink_to_fit();
    return waiting.size() - before;
}

void RequestReader::take_message() {
    const std::uint64_t memory = memory_of(decoder_.values(), decoder_.bytes());
    ReadRequest request;
    request.bytes = decoder_.bytes();
    request.message = decoder_.take();
    closed_ = name_in(request.message) == "close";
    if (closed_) return;
    if (memory > small_bytes) {
        memory_.resize(share_, memory);
        request.share = std::exchange(share_, {});
    }
    waiting_bytes_ += request.bytes;
    waiting.push_back(std::move(request));
}

ReadRequest RequestReader::take() {
    ReadRequest request = std::move(waiting.front());
    waiting.pop_front();
    waiting_bytes_ -= request.bytes;
    return request;
}

} // namespace obscura::service::compatible
