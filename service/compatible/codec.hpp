// SPDX-License-Identifier: Apache-2.0
// Codec of the compatible protocol: Qt's QDataStream encoding of a hash of variants.
//
// A message is a hash without any length in front; all is big-endian. Hash: u32 count, then for each field a
// string and a value. String: u32 bytes (0xFFFFFFFF: empty), UTF-16. Value: u32 type, u8 null flag, payload.
#pragma once

#include "service/compatible/limits.hpp"
#include "service/compatible/value.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::service::compatible {

/// Reads messages from a stream that arrives in parts; each byte is looked at once. After an exception the
/// stream cannot be read on.
class Decoder {
public:
    explicit Decoder(const CompatibleLimits& limits) : limits_(limits) {}

    /// Reads on to the end of the message at most. Returns how many bytes of `text` it has read: the rest is
    /// wanted again, with more behind it. Throws Failure (bad_message) for an unknown type or text that is no
    /// UTF-16, (too_large) beyond a limit.
    std::size_t read(std::string_view text);
    /// A message has been read.
    [[nodiscard]] bool complete() const noexcept { return complete_; }
    /// Whether a part of a message has been read.
    [[nodiscard]] bool begun() const noexcept { return bytes_ > 0 && !complete_; }
    /// Bytes of the message so far.
    [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
    /// Values of the message so far.
    [[nodiscard]] std::size_t values() const noexcept { return values_; }
    /// The message; then the next one begins.
    [[nodiscard]] Fields take();

private:
    /// A map or list whose items have not all been read.
    struct Open {
        bool is_map = false;
        std::uint32_t left = 0;
        bool has_name = false;
        std::string name{}; ///< of the field whose value follows
        Fields fields{};
        List list{};
    };
    class Reader;

    [[nodiscard]] bool read_item(Reader& reader);
    [[nodiscard]] bool read_value(Reader& reader);
    [[nodiscard]] bool open(Reader& reader, bool is_map);
    void add(Value value);
    /// Makes the innermost map or list a value of the one around it if it is complete.
    void close();

    const CompatibleLimits limits_;
    std::vector<Open> open_;
    Fields message_;
    std::size_t bytes_ = 0, values_ = 0;
    bool complete_ = false;
};

/// The message as it is sent.
[[nodiscard]] std::string encode(const Fields& message);
/// The beginning of a message that has a last field more: bytes called `name`, of which `size` follow.
[[nodiscard]] std::string encode(const Fields& message, std::string_view name, std::size_t size);

} // namespace obscura::service::compatible
