// SPDX-License-Identifier: Apache-2.0
#include "service/outbox.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace obscura::service {
namespace {

/// Parts of the message behind its first `sent` bytes: at most `most` bytes, and as many parts as one call
/// sends.
std::vector<iovec> parts_of(const Outgoing& message, std::size_t sent, std::size_t most) {
    std::vector<iovec> parts;
    const auto add = [&](std::span<const std::byte> bytes) {
        const std::size_t skipped = std::min(sent, bytes.size());
        sent -= skipped;
        bytes = bytes.subspan(skipped);
        bytes = bytes.first(std::min(bytes.size(), most));
        most -= bytes.size();
        // sendmsg() takes the parts as writable, and only reads them.
        if (!bytes.empty()) parts.push_back({const_cast<std::byte*>(bytes.data()), bytes.size()});
    };
    add(std::as_bytes(std::span(message.start)));
    static constexpr std::byte zeros[8]{};
    std::uint64_t offset = 0;
    for (const Array& array : message.arrays) {
        const std::span<const std::byte> bytes = bytes_of(array);
        const std::size_t between = padding(offset);
        add(std::span(zeros).first(between));
        add(bytes);
        offset += between + bytes.size();
    }
    constexpr std::size_t max_parts = 64;
    parts.resize(std::min(parts.size(), max_parts));
    return parts;
}

} // namespace

Outbox::Entry Outbox::entry(Outgoing message, const void* lane) {
    std::size_t bytes = 0;
    for (const Array& array : message.arrays)
        bytes += padding(bytes) + bytes_of(array).size();
    bytes += message.start.size();
    return {std::move(message), bytes, lane};
}

void Outbox::add(Outgoing message) {
    short_.push_back(entry(std::move(message), nullptr));
}

void Outbox::add(Outgoing message, const void* lane) {
    bulk_.push_back(entry(std::move(message), lane));
}

bool Outbox::holds(const void* lane) const {
    return std::any_of(bulk_.begin(), bulk_.end(), [lane](const Entry& e) { return e.lane == lane; });
}

void Outbox::clear() {
    short_.clear();
    for (Entry& each : bulk_)
        sent_.push_back(std::move(each.message));
    bulk_.clear();
    begun_ = nullptr;
    offset_ = 0;
}

bool Outbox::send(int socket, std::size_t most) {
    bool left = false;
    while (most > 0 && !empty()) {
        if (begun_ == nullptr) begun_ = short_.empty() ? &bulk_ : &short_;
        Entry& first = begun_->front();
        std::vector<iovec> parts = parts_of(first.message, offset_, most);
        msghdr message{};
        message.msg_iov = parts.data();
        message.msg_iovlen = parts.size();
        alignas(cmsghdr) char control[CMSG_SPACE(max_descriptors * sizeof(int))]{};
        const std::size_t files = sizeof(int) * first.message.descriptors.size();
        if (offset_ == 0 && files > 0) {
            message.msg_control = control;
            message.msg_controllen = CMSG_SPACE(files);
            cmsghdr* const rights = CMSG_FIRSTHDR(&message);
            rights->cmsg_level = SOL_SOCKET;
            rights->cmsg_type = SCM_RIGHTS;
            rights->cmsg_len = CMSG_LEN(files);
            std::memcpy(CMSG_DATA(rights), first.message.descriptors.data(), files);
        }
        const ssize_t bytes = ::sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (bytes < 0) { // a broken connection is an event of its own
            if (offset_ == 0) begun_ = nullptr;
            break;
        }
        offset_ += static_cast<std::size_t>(bytes);
        most -= std::min(most, static_cast<std::size_t>(bytes));
        if (offset_ < first.bytes) continue;
        if (first.lane != nullptr) {
            sent_.push_back(std::move(first.message));
            left = true;
        }
        begun_->pop_front();
        begun_ = nullptr;
        offset_ = 0;
    }
    return left;
}

std::vector<Outgoing> Outbox::take_sent() {
    return std::exchange(sent_, {});
}

} // namespace obscura::service
