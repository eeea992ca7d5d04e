// SPDX-License-Identifier: Apache-2.0
// Chunk ids, and coding of the fields of a frame's record in the data appended to its pixels.
#pragma once

#include "core/camera/frame_record.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace obscura::transports::gige {

using obscura::Chunk;
using obscura::chunk_count;

/// Id of the image itself; those of the chunks follow.
constexpr std::uint32_t chunk_id_base = 0x4F420000;
constexpr std::size_t chunk_tag_bytes = 8;

constexpr std::uint32_t chunk_bit(Chunk c) noexcept {
    return 1U << static_cast<unsigned>(c);
}

constexpr std::uint32_t chunk_id(Chunk c) noexcept {
    return chunk_id_base + 1 + static_cast<std::uint32_t>(c);
}

/// Writes the fields of `owner` to the record that begins at `out`; other bytes stay. Real-time safe.
template<typename Owner>
void store_field(std::uint8_t* out, const RecordField<Owner>& field, const Owner& owner) noexcept {
    for (std::size_t i = 0; i < field.count; ++i) {
        std::uint8_t* const at = out + field.offset + i * bytes_of(field.form);
        const FieldValue value = field.get(owner, field.first + i);
        if (const auto* text = std::get_if<std::string_view>(&value)) {
            std::memcpy(at, text->data(), text->size());
        } else if (const auto* real = std::get_if<double>(&value)) {
            store_be64(at, std::bit_cast<std::uint64_t>(field.chunk_scale * *real));
        } else {
            const auto* negative = std::get_if<std::int64_t>(&value);
            const std::uint64_t word = negative != nullptr ? static_cast<std::uint64_t>(*negative)
                                                           : *std::get_if<std::uint64_t>(&value);
            if (field.form == FieldForm::u8)
                *at = static_cast<std::uint8_t>(word);
            else if (bytes_of(field.form) == 4)
                store_be32(at, static_cast<std::uint32_t>(word));
            else
                store_be64(at, word);
        }
    }
}
template<typename Owner>
void store_record(std::uint8_t* out, const Owner& owner) noexcept {
    for (const RecordField<Owner>& field : record_fields<Owner>())
        if (field.in_chunk) store_field(out, field, owner);
}

/// Reads the fields of `owner` from the record that begins at `in`, which has all its bytes.
template<typename Owner>
void load_field(const std::uint8_t* in, const RecordField<Owner>& field, Owner& owner) noexcept {
    for (std::size_t i = 0; i < field.count; ++i) {
        const std::uint8_t* const at = in + field.offset + i * bytes_of(field.form);
        const auto set = [&](const FieldValue& value) { field.set(owner, field.first + i, value); };
        switch (field.form) {
        case FieldForm::u8:
            set(std::uint64_t{*at});
            break;
        case FieldForm::u32:
            set(std::uint64_t{load_be32(at)});
            break;
        case FieldForm::i32:
            set(std::int64_t{static_cast<std::int32_t>(load_be32(at))});
            break;
        case FieldForm::u64:
            set(load_be64(at));
            break;
        case FieldForm::i64:
            set(static_cast<std::int64_t>(load_be64(at)));
            break;
        case FieldForm::f64:
            set(std::bit_cast<double>(load_be64(at)) * (1 / field.chunk_scale));
            break;
        case FieldForm::text:
            set(std::string_view(reinterpret_cast<const char*>(at), field_text_bytes));
            break;
        }
    }
}
template<typename Owner>
[[nodiscard]] Owner load_record(const std::uint8_t* in) noexcept {
    Owner owner{};
    for (const RecordField<Owner>& field : record_fields<Owner>())
        if (field.in_chunk) load_field(in, field, owner);
    return owner;
}

} // namespace obscura::transports::gige
