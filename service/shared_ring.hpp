// SPDX-License-Identifier: Apache-2.0
// Ring of slots in shared memory, which takes the arrays of answers to a client on the same machine.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/array.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace obscura::service {

/// Memory file of slots that are written in turn, sealed so that its size stays and only this process can
/// write it. A slot begins with a head, little-endian: sequence u64, id of the request u32, 0 u32, bytes of
/// the arrays u64. The sequence is odd while the slot is written, and another even number after each time:
/// who finds the number of the answer after reading has read that answer. Thread-bound; readers need nothing.
class SharedRing {
public:
    static constexpr std::size_t head_bytes = 64;

    /// Slots for arrays of `slot_bytes`. Throws HardwareError.
    SharedRing(std::size_t slots, std::size_t slot_bytes);
    ~SharedRing();
    SharedRing(const SharedRing&) = delete;
    SharedRing& operator=(const SharedRing&) = delete;

    [[nodiscard]] int file() const noexcept { return file_.get(); }
    /// From one slot to the next.
    [[nodiscard]] std::size_t stride() const noexcept { return stride_; }

    struct Place {
        std::size_t slot;
        std::uint64_t sequence;
    };
    /// Writes arrays as they stand in the body of a message; none: they are larger than a slot.
    [[nodiscard]] std::optional<Place> write(std::uint32_t id, const std::vector<Array>& arrays);

private:
    FileDescriptor file_;
    std::size_t slots_, slot_bytes_, stride_;
    std::byte* memory_ = nullptr;
    std::uint64_t written_ = 0;
};

} // namespace obscura::service
