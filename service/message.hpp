// SPDX-License-Identifier: Apache-2.0
// Messages of the native protocol: frame of 24 bytes, MessagePack head, raw arrays.
#pragma once

#include "service/array.hpp"
#include "service/limits.hpp"
#include "service/memory_account.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::service {

/// Version of the protocol.
constexpr std::uint8_t protocol_version = 1;

/// Kind of a message.
enum class MessageKind : std::uint8_t { request = 1, answer = 2, event = 3, error = 4 };

/// Frame of a message, little-endian: "OBSC", version, kind, flags u16, id u32, head bytes u32, body bytes
/// u64.
struct Frame {
    static constexpr std::size_t bytes = 24;
    MessageKind kind = MessageKind::request;
    std::uint32_t id = 0; ///< chosen by the client; answers, events and errors have that of their request
    std::uint32_t head_bytes = 0;
    std::uint64_t body_bytes = 0;
};

/// The frame as it is sent.
[[nodiscard]] std::string frame_text(const Frame& frame);
/// Reads the first Frame::bytes of `text`. Throws Failure (bad_message) if they are no frame of this version,
/// or (too_large) if head or body exceed the limits.
[[nodiscard]] Frame read_frame(std::string_view text, const Limits& limits);

/// The head of a message: a map of nil, booleans, integers of 64 bits, doubles, strings, arrays and maps with
/// distinct string keys. Throws Failure (bad_message) with the place if `text` is anything else, ends early,
/// goes on behind the map, is no UTF-8 or exceeds the limits of depth or number of values.
[[nodiscard]] nlohmann::json read_head(std::string_view text, const Limits& limits);

/// A value as a head carries it and as its JSON text would say: numbers that are not finite are nil, bytes
/// that are no UTF-8 are replaced.
[[nodiscard]] nlohmann::json head_of(const nlohmann::ordered_json& value);

/// Most descriptors of a message.
constexpr std::size_t max_descriptors = 4;
/// A message on its way to a client: frame and head in `start`, then the arrays.
struct Outgoing {
    std::string start;
    std::vector<Array> arrays{};
    std::shared_ptr<void> keep{};   ///< lives until the message has been sent
    MemoryAccount::Share share{};   ///< of the arrays
    std::vector<int> descriptors{}; ///< go along with the first byte, over a Unix socket
};
/// Bytes between an array that ends at `offset` of the body and the next: arrays begin at multiples of 8.
[[nodiscard]] constexpr std::size_t padding(std::uint64_t offset) {
    return static_cast<std::size_t>(-offset % 8);
}
/// Rows of the member `arrays` of a head.
[[nodiscard]] nlohmann::json list_arrays(const std::vector<Array>& arrays);
/// Adds the member `arrays` to the head if there are any.
[[nodiscard]] Outgoing make_message(MessageKind kind, std::uint32_t id, nlohmann::json head,
                                    std::vector<Array> arrays = {});

} // namespace obscura::service
