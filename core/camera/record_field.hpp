// SPDX-License-Identifier: Apache-2.0
// One row of the table of a frame's record: a value, its chunk, card, column and JSON member.
#pragma once

#include "core/camera/scene_truth.hpp"
#include "core/member_chain.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

namespace obscura {

/// Form of a field in a chunk. Numbers are big endian, text ends with zeros.
enum class FieldForm : std::uint8_t { u8, u32, i32, u64, i64, f64, text };
constexpr std::size_t field_text_bytes = 32;

[[nodiscard]] constexpr std::size_t bytes_of(FieldForm form) noexcept {
    switch (form) {
    case FieldForm::u8:
        return 1;
    case FieldForm::u32:
    case FieldForm::i32:
        return 4;
    case FieldForm::text:
        return field_text_bytes;
    default:
        return 8;
    }
}

/// Unsigned for u8, u32 and u64, signed for i32 and i64, double for f64; text with its zeros.
using FieldValue = std::variant<std::uint64_t, std::int64_t, double, std::string_view>;

/// A value of `Owner`, known to the program by `name`. The other names are public: each way out has its own.
/// get() and set() are real-time safe.
template<typename Owner>
struct RecordField {
    std::string_view name;
    FieldForm form = FieldForm::u32;
    std::size_t first = 0, count = 1; ///< elements of an array
    FieldValue (*get)(const Owner& owner, std::size_t element) = nullptr;
    /// An enumerator that does not exist becomes the last one.
    void (*set)(Owner& owner, std::size_t element, const FieldValue& value) = nullptr;
    /// Name of an enumerator; null for numbers.
    std::string_view (*text)(const Owner& owner, std::size_t element) = nullptr;
    /// Elements that hold something, of an array that is not always full; null: all.
    std::size_t (*used)(const Owner& owner) = nullptr;
    std::string_view unit = "", help = ""; ///< for features and calls

    // Chunk. Fields of items of a list count their offset from the beginning of the item.
    bool in_chunk = false;
    std::size_t offset = 0;
    double chunk_scale = 1; ///< a unit of the chunk is so many of the member
    std::string_view feature = "";
    bool custom = true; ///< the feature is not of SFNC

    std::string_view card = "", card_help = ""; ///< FITS key, or what follows the prefix of an item
    int card_place = 0;                         ///< fields with a larger one come later among cards
    std::string_view card_ends = "";            ///< arrays: last letter of the key of each element
    double card_scale = 0;                      ///< reals: a unit of the card is so many; 0: 1
    std::string_view member = "";               ///< of JSON
    std::string_view header = "";               ///< of HTTP, behind X-Obscura-

    // Timing file: a whole number.
    std::string_view column = "";
    int column_place = -1;   ///< from 0; new columns come last
    double column_scale = 0; ///< rounded multiple of the value; 0: the value without its fraction
    bool is_instant = false; ///< 0: the frame does not have it
    bool in_first_files = false;

    /// At `byte` of the chunk, or of the item of its list.
    [[nodiscard]] constexpr RecordField at(std::size_t byte, double scale = 1) const {
        RecordField out = *this;
        out.in_chunk = true, out.offset = byte, out.chunk_scale = scale;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_feature(std::string_view title,
                                                   std::string_view text_of_help = {}) const {
        RecordField out = *this;
        out.feature = title, out.help = text_of_help;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_sfnc(std::string_view title,
                                                std::string_view text_of_help = {}) const {
        RecordField out = as_feature(title, text_of_help);
        out.custom = false;
        return out;
    }
    [[nodiscard]] constexpr RecordField in(std::string_view unit_name) const {
        RecordField out = *this;
        out.unit = unit_name;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_card(std::string_view key, std::string_view text_of_help,
                                                int place = 0) const {
        RecordField out = *this;
        out.card = key, out.card_help = text_of_help, out.card_place = place;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_member(std::string_view title = {}) const {
        RecordField out = *this;
        out.member = title.empty() ? name : title;
        return out;
    }
    [[nodiscard]] constexpr RecordField with_help(std::string_view text_of_help) const {
        RecordField out = *this;
        out.help = text_of_help;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_header(std::string_view title) const {
        RecordField out = *this;
        out.header = title;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_cards(std::string_view key, std::string_view ends,
                                                 std::string_view text_of_help, int place) const {
        RecordField out = as_card(key, text_of_help, place);
        out.card_ends = ends;
        return out;
    }
    [[nodiscard]] constexpr RecordField in_cards_over(double scale) const {
        RecordField out = *this;
        out.card_scale = scale;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_column(int place, std::string_view title = {},
                                                  double scale = 0) const {
        RecordField out = *this;
        out.column_place = place, out.column = title.empty() ? name : title, out.column_scale = scale;
        return out;
    }
    [[nodiscard]] constexpr RecordField as_instant() const {
        RecordField out = *this;
        out.is_instant = true;
        return out;
    }
    /// All timing files have the column; others are 0 in files of older versions.
    [[nodiscard]] constexpr RecordField from_the_first() const {
        RecordField out = *this;
        out.in_first_files = true;
        return out;
    }
    [[nodiscard]] constexpr RecordField with_used(std::size_t (*number)(const Owner&)) const {
        RecordField out = *this;
        out.used = number;
        return out;
    }
    /// One element of the array.
    [[nodiscard]] constexpr RecordField element(std::size_t index) const {
        RecordField out = *this;
        out.first = index, out.count = 1;
        return out;
    }
};

namespace record_field {

/// Numbers in a member of a record: one, or those of an array; a text is one.
template<typename T>
struct Elements {
    using type = T;
    static constexpr std::size_t count = 1;
    static constexpr auto& of(auto& value, std::size_t /*index*/) { return value; }
};
/// Array of n numbers.
template<typename T, std::size_t n>
struct Elements<std::array<T, n>> {
    using type = T;
    static constexpr std::size_t count = n;
    static constexpr auto& of(auto& value, std::size_t index) { return value[index]; }
};
/// Text of n bytes.
template<std::size_t n>
struct Elements<std::array<char, n>> {
    static_assert(n == field_text_bytes);
    using type = std::array<char, n>;
    static constexpr std::size_t count = 1;
    static constexpr auto& of(auto& value, std::size_t /*index*/) { return value; }
};

template<typename T>
constexpr FieldForm form_of() {
    if constexpr (std::is_enum_v<T>) {
        return FieldForm::u32;
    } else if constexpr (std::is_floating_point_v<T>) {
        return FieldForm::f64;
    } else if constexpr (std::is_same_v<T, Time>) {
        return FieldForm::i64;
    } else if constexpr (!std::is_integral_v<T>) {
        return FieldForm::text;
    } else if constexpr (std::is_signed_v<T>) {
        return sizeof(T) > 4 ? FieldForm::i64 : FieldForm::i32;
    } else {
        return sizeof(T) > 4 ? FieldForm::u64 : FieldForm::u32;
    }
}

template<typename T>
FieldValue value_of(const T& value) {
    if constexpr (std::is_enum_v<T>) {
        return static_cast<std::uint64_t>(value);
    } else if constexpr (std::is_floating_point_v<T>) {
        return static_cast<double>(value);
    } else if constexpr (std::is_same_v<T, Time>) {
        return value.ns;
    } else if constexpr (std::is_same_v<T, TruthName>) {
        return std::string_view(value.bytes().data(), value.bytes().size());
    } else if constexpr (!std::is_integral_v<T>) {
        return std::string_view(value.data(), value.size());
    } else if constexpr (std::is_signed_v<T>) {
        return std::int64_t{value};
    } else {
        return std::uint64_t{value};
    }
}

template<typename T>
void assign(T& value, const FieldValue& from) {
    if constexpr (std::is_enum_v<T>) {
        value = static_cast<T>(
            std::min<std::uint64_t>(*std::get_if<std::uint64_t>(&from), enum_names(T{}).size() - 1));
    } else if constexpr (std::is_floating_point_v<T>) {
        value = static_cast<T>(*std::get_if<double>(&from));
    } else if constexpr (std::is_same_v<T, Time>) {
        value.ns = *std::get_if<std::int64_t>(&from);
    } else if constexpr (std::is_same_v<T, TruthName>) {
        const auto& text = *std::get_if<std::string_view>(&from);
        value.set(text.substr(0, text.find('\0')));
    } else if constexpr (!std::is_integral_v<T>) {
        const auto& text = *std::get_if<std::string_view>(&from);
        value.fill('\0');
        std::copy_n(text.begin(), std::min(text.size(), value.size()), value.begin());
    } else if constexpr (std::is_signed_v<T>) {
        value = static_cast<T>(*std::get_if<std::int64_t>(&from));
    } else {
        value = static_cast<T>(*std::get_if<std::uint64_t>(&from));
    }
}

} // namespace record_field

/// The row of a member: field<&Pose::position_m, &Vec3::x>("x"). Arrays of bytes of enumerators: `form` u8.
template<auto first, auto... rest>
constexpr auto field(std::string_view name) {
    using Owner = decltype(member_chain::owner_of(first));
    using Member = std::remove_cvref_t<decltype(member_chain::at<first, rest...>(std::declval<Owner&>()))>;
    using Elements = record_field::Elements<Member>;
    using Value = typename Elements::type;
    RecordField<Owner> out;
    out.name = name;
    out.form = record_field::form_of<Value>();
    out.count = Elements::count;
    out.get = [](const Owner& owner, std::size_t element) {
        return record_field::value_of<Value>(Elements::of(member_chain::at<first, rest...>(owner), element));
    };
    out.set = [](Owner& owner, std::size_t element, const FieldValue& value) {
        record_field::assign<Value>(Elements::of(member_chain::at<first, rest...>(owner), element), value);
    };
    if constexpr (NamedEnum<Value>) {
        if (Elements::count > 1) out.form = FieldForm::u8;
        out.text = [](const Owner& owner, std::size_t element) {
            return name_of(Elements::of(member_chain::at<first, rest...>(owner), element));
        };
    }
    return out;
}

/// Bytes of a record: to the end of its last field.
template<typename Owner>
[[nodiscard]] constexpr std::size_t record_bytes(const auto& fields) noexcept {
    std::size_t bytes = 0;
    for (const RecordField<Owner>& field : fields)
        if (field.in_chunk) bytes = std::max(bytes, field.offset + bytes_of(field.form) * field.count);
    return bytes;
}

/// Whether no byte of a record belongs to two fields.
template<typename Owner>
[[nodiscard]] constexpr bool is_disjoint(const auto& fields) noexcept {
    for (const RecordField<Owner>& a : fields)
        for (const RecordField<Owner>& b : fields)
            if (&a != &b && a.in_chunk && b.in_chunk && a.offset <= b.offset &&
                b.offset < a.offset + bytes_of(a.form) * a.count)
                return false;
    return true;
}

} // namespace obscura
