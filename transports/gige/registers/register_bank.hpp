// SPDX-License-Identifier: Apache-2.0
// Register bank: the device's address space as a table of registers with access rights, locks and effects.
#pragma once

#include "transports/gige/wire/gvcp.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports::gige {

enum class Access : std::uint8_t { read_only, write_only, read_write };

/// Whether a text register takes `text`: printable ASCII (0x20 to 0x7E) only.
[[nodiscard]] bool is_register_text(std::string_view text);

/// One register or block of registers. Without `read` a register returns its stored word, `reset` at first;
/// without `write` a written word is stored if it lies in [minimum, maximum]. All functions are called on the
/// control thread.
struct Register {
    std::string_view name; ///< bootstrap or SFNC name, static storage
    std::uint32_t address = 0;
    std::uint32_t bytes = 4; ///< a multiple of 4
    Access access = Access::read_only;
    bool locked_while_streaming = false; ///< writes are refused with WRITE_PROTECT during acquisition
    bool saved = false;                  ///< part of user sets
    std::uint32_t reset = 0;
    std::uint32_t minimum = 0, maximum = 0xFFFFFFFF;
    std::function<std::uint32_t()> read = {}; ///< words only
    std::function<std::uint32_t()> kept = {}; ///< with `saved`: the word for user sets; empty: as read
    /// Words only: checks the word, then applies it; nothing changes on refusal.
    std::function<Status(std::uint32_t)> write = {};
    std::function<void()> written = {}; ///< called after a write
    /// Bytes that are not printable ASCII or zero are refused. What comes after the first zero has no
    /// meaning.
    bool is_text = false;
    std::vector<std::uint8_t> contents = {}; ///< blocks (bytes != 4): stored bytes
};

/// Address space of the device. READREG and READMEM both use read(), WRITEREG and WRITEMEM both write(), so
/// that they have the same effects. Thread-bound: control thread.
class RegisterBank {
public:
    /// Adds an entry. Throws std::logic_error when it overlaps another or is misaligned (a bug in the table).
    Register& add(Register r);
    /// A zero-padded string of `bytes` bytes. Clients may write printable ASCII only.
    Register& add_string(std::string_view name, std::uint32_t address, std::uint32_t bytes, Access access,
                         std::string_view value);
    /// Read-only bytes of any length (the XML file), padded to a multiple of 4.
    Register& add_block(std::string_view name, std::uint32_t address, std::span<const std::uint8_t> contents);

    /// `streaming` returns whether writes to locked registers are refused now.
    void set_lock(std::function<bool()> streaming) { streaming_ = std::move(streaming); }

    /// Fills `out` (length and address multiples of 4) from as many entries as it spans.
    Status read(std::uint32_t address, std::span<std::uint8_t> out) const;
    Status read_word(std::uint32_t address, std::uint32_t& value) const;
    /// Writes entry by entry and stops at the first refusal; `done` is the number of bytes written.
    Status write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done);
    Status write_word(std::uint32_t address, std::uint32_t value);

    /// Access of the device itself to what is stored, without access rights, checks and side effects.
    void poke(std::uint32_t address, std::uint32_t value);
    [[nodiscard]] std::uint32_t peek(std::uint32_t address) const;
    [[nodiscard]] std::string text(std::uint32_t address) const;
    void set_text(std::uint32_t address, std::string_view text);

    [[nodiscard]] const Register* find(std::uint32_t address) const noexcept;
    /// Sorted by address.
    [[nodiscard]] std::span<const Register> table() const noexcept { return table_; }

private:
    [[nodiscard]] Register* find_mutable(std::uint32_t address) noexcept;
    std::vector<Register> table_;
    std::function<bool()> streaming_;
};

} // namespace obscura::transports::gige
