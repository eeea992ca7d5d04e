// SPDX-License-Identifier: Apache-2.0
// Machine code in memory that nothing can write any more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace obscura::models {

/// Code written to a memfd, sealed, and mapped for reading and execution: allowed under systemd's
/// MemoryDenyWriteExecute=, since no page is ever writable and executable. Movable.
class SealedCode {
public:
    SealedCode() = default;
    /// Nothing is mapped, and `why` says why, where the kernel or its policy does not allow it.
    SealedCode(std::span<const std::uint8_t> code, std::string& why);
    ~SealedCode();
    SealedCode(SealedCode&& other) noexcept
        : memory_(std::exchange(other.memory_, nullptr)), bytes_(other.bytes_) {}
    SealedCode& operator=(SealedCode&& other) noexcept {
        std::swap(memory_, other.memory_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    SealedCode(const SealedCode&) = delete;
    SealedCode& operator=(const SealedCode&) = delete;

    /// Null: nothing is mapped.
    [[nodiscard]] const void* entry() const noexcept { return memory_; }
    [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

private:
    void* memory_ = nullptr;
    std::size_t bytes_ = 0;
};

} // namespace obscura::models
