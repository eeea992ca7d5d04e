// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/registers/register_bank.hpp"

#include "transports/gige/wire/bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <stdexcept>

namespace obscura::transports::gige {
namespace {

constexpr bool is_printable(std::uint8_t byte) {
    return byte >= 0x20 && byte <= 0x7E;
}

} // namespace

bool is_register_text(std::string_view text) {
    return std::all_of(text.begin(), text.end(),
                       [](char c) { return is_printable(static_cast<std::uint8_t>(c)); });
}

Register& RegisterBank::add(Register r) {
    const auto at = std::upper_bound(table_.begin(), table_.end(), r.address,
                                     [](std::uint32_t a, const Register& e) { return a < e.address; });
    const bool overlaps_next = at != table_.end() && std::uint64_t{r.address} + r.bytes > at->address;
    const bool overlaps_previous =
        at != table_.begin() && std::uint64_t{(at - 1)->address} + (at - 1)->bytes > r.address;
    if (r.address % 4 != 0 || r.bytes == 0 || r.bytes % 4 != 0 || overlaps_next || overlaps_previous)
        throw std::logic_error(
            fmt::format("register {} at {:#x} overlaps or is misaligned", r.name, r.address));
    if (r.contents.empty()) {
        r.contents.resize(r.bytes);
        if (r.bytes == 4) store_be32(r.contents.data(), r.reset);
    }
    return *table_.insert(at, std::move(r));
}

Register& RegisterBank::add_string(std::string_view name, std::uint32_t address, std::uint32_t bytes,
                                   Access access, std::string_view value) {
    Register r;
    r.name = name;
    r.address = address;
    r.bytes = bytes;
    r.access = access;
    r.is_text = true;
    r.contents.assign(bytes, 0);
    // The last byte stays 0 unless the string fills the field exactly, which the standard allows.
    std::memcpy(r.contents.data(), value.data(), std::min<std::size_t>(value.size(), bytes));
    return add(std::move(r));
}

Register& RegisterBank::add_block(std::string_view name, std::uint32_t address,
                                  std::span<const std::uint8_t> contents) {
    Register r;
    r.name = name;
    r.address = address;
    r.contents.assign(contents.begin(), contents.end());
    r.contents.resize((contents.size() + 3) / 4 * 4);
    r.bytes = static_cast<std::uint32_t>(r.contents.size());
    return add(std::move(r));
}

const Register* RegisterBank::find(std::uint32_t address) const noexcept {
    const auto after = std::upper_bound(table_.begin(), table_.end(), address,
                                        [](std::uint32_t a, const Register& e) { return a < e.address; });
    if (after == table_.begin()) return nullptr;
    const Register& r = *(after - 1);
    return address - r.address < r.bytes ? &r : nullptr;
}

Register* RegisterBank::find_mutable(std::uint32_t address) noexcept {
    return const_cast<Register*>(find(address));
}

Status RegisterBank::read(std::uint32_t address, std::span<std::uint8_t> out) const {
    if (address % 4 != 0) return Status::bad_alignment;
    if (out.size() % 4 != 0) return Status::invalid_parameter;
    std::uint64_t at = address; // 64 bits: address + length may exceed 2^32
    for (std::size_t done = 0; done < out.size();) {
        const Register* r = at > 0xFFFFFFFF ? nullptr : find(static_cast<std::uint32_t>(at));
        if (r == nullptr) return Status::invalid_address;
        const auto inside = static_cast<std::uint32_t>(at - r->address);
        const std::size_t n = std::min<std::size_t>(r->bytes - inside, out.size() - done);
        if (r->access == Access::write_only) {
            std::memset(out.data() + done, 0, n);
        } else if (r->bytes == 4 && r->read) {
            store_be32(out.data() + done, r->read());
        } else {
            std::memcpy(out.data() + done, r->contents.data() + inside, n);
        }
        done += n;
        at += n;
    }
    return Status::success;
}

Status RegisterBank::read_word(std::uint32_t address, std::uint32_t& value) const {
    std::uint8_t bytes[4] = {};
    const Status status = read(address, bytes);
    value = load_be32(bytes);
    return status;
}

Status RegisterBank::write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done) {
    done = 0;
    if (address % 4 != 0) return Status::bad_alignment;
    if (bytes.size() % 4 != 0) return Status::invalid_parameter;
    std::uint64_t at = address;
    while (done < bytes.size()) {
        Register* r = at > 0xFFFFFFFF ? nullptr : find_mutable(static_cast<std::uint32_t>(at));
        if (r == nullptr) return Status::invalid_address;
        if (r->access == Access::read_only) return Status::write_protect;
        if (r->locked_while_streaming && streaming_ && streaming_()) return Status::write_protect;
        const auto inside = static_cast<std::uint32_t>(at - r->address);
        const std::size_t n = std::min<std::size_t>(r->bytes - inside, bytes.size() - done);
        if (r->bytes == 4) {
            const std::uint32_t value = load_be32(bytes.data() + done);
            if (value < r->minimum || value > r->maximum) return Status::invalid_parameter;
            if (r->write) {
                const Status status = r->write(value);
                if (status != Status::success) return status;
            } else {
                store_be32(r->contents.data(), value);
            }
        } else {
            const auto from = bytes.subspan(done, n);
            const auto takes = [](std::uint8_t byte) { return byte == 0 || is_printable(byte); };
            if (r->is_text && !std::all_of(from.begin(), from.end(), takes)) return Status::invalid_parameter;
            std::copy(from.begin(), from.end(), r->contents.begin() + inside);
        }
        if (r->written) r->written();
        done += n;
        at += n;
    }
    return Status::success;
}

Status RegisterBank::write_word(std::uint32_t address, std::uint32_t value) {
    std::uint8_t bytes[4];
    store_be32(bytes, value);
    std::size_t done = 0;
    return write(address, bytes, done);
}

void RegisterBank::poke(std::uint32_t address, std::uint32_t value) {
    Register* r = find_mutable(address);
    assert(r != nullptr);
    store_be32(r->contents.data() + (address - r->address), value);
}

std::uint32_t RegisterBank::peek(std::uint32_t address) const {
    const Register* r = find(address);
    assert(r != nullptr);
    return load_be32(r->contents.data() + (address - r->address));
}

void RegisterBank::set_text(std::uint32_t address, std::string_view text) {
    Register* r = find_mutable(address);
    assert(r != nullptr && r->address == address);
    std::fill(r->contents.begin(), r->contents.end(), std::uint8_t{0});
    std::memcpy(r->contents.data(), text.data(), std::min<std::size_t>(text.size(), r->bytes));
}

std::string RegisterBank::text(std::uint32_t address) const {
    const Register* r = find(address);
    assert(r != nullptr && r->address == address);
    const auto* begin = reinterpret_cast<const char*>(r->contents.data());
    return {begin, strnlen(begin, r->bytes)};
}

} // namespace obscura::transports::gige
