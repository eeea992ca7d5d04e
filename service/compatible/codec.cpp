// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/codec.hpp"

#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <utility>

namespace obscura::service::compatible {
namespace {

/// Type numbers of Qt 5.
enum Type : std::uint32_t {
    type_none = 0,
    type_bool = 1,
    type_int = 2,
    type_uint = 3,
    type_u64 = 5,
    type_double = 6,
    type_map = 8,
    type_list = 9,
    type_string = 10,
    type_bytes = 12,
    type_hash = 28,
};
constexpr std::uint32_t empty_length = 0xFFFFFFFF;
/// Items for which room is made ahead: a count is no promise.
constexpr std::uint32_t max_reserved = 4096;

Failure broken(const std::string& what) {
    return {FailureCode::bad_message, what};
}

void append_utf8(std::string& out, std::uint32_t code) {
    const auto part = [&](std::uint32_t bits, int shift, std::uint32_t mark) {
        out.push_back(static_cast<char>(mark | ((bits >> shift) & 0x3FU)));
    };
    if (code < 0x80) {
        out.push_back(static_cast<char>(code));
    } else if (code < 0x800) {
        out.push_back(static_cast<char>(0xC0 | (code >> 6)));
        part(code, 0, 0x80);
    } else if (code < 0x10000) {
        out.push_back(static_cast<char>(0xE0 | (code >> 12)));
        part(code, 6, 0x80), part(code, 0, 0x80);
    } else {
        out.push_back(static_cast<char>(0xF0 | (code >> 18)));
        part(code, 12, 0x80), part(code, 6, 0x80), part(code, 0, 0x80);
    }
}

std::string utf8_of(std::string_view utf16) {
    const auto unit = [&](std::size_t i) {
        return static_cast<std::uint32_t>(static_cast<unsigned char>(utf16[i])) << 8 |
               static_cast<unsigned char>(utf16[i + 1]);
    };
    std::string out;
    out.reserve(utf16.size() / 2);
    for (std::size_t i = 0; i < utf16.size(); i += 2) {
        std::uint32_t code = unit(i);
        if (code >= 0xD800 && code < 0xE000) {
            const std::uint32_t low = i + 2 < utf16.size() ? unit(i + 2) : 0;
            if (code >= 0xDC00 || low < 0xDC00 || low >= 0xE000)
                throw broken("a string that is no UTF-16: a surrogate stands alone");
            code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
            i += 2;
        }
        append_utf8(out, code);
    }
    return out;
}

template<typename Unsigned>
void append_number(std::string& out, Unsigned number) {
    for (int shift = (static_cast<int>(sizeof number) - 1) * 8; shift >= 0; shift -= 8)
        out.push_back(static_cast<char>(number >> shift & 0xFFU));
}

/// The next character of UTF-8 text, which is cut off its front; U+FFFD for what is none.
std::uint32_t next_code(std::string_view& text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])) : 0U;
    };
    const std::uint32_t first = byte(0);
    const std::size_t more = first < 0x80 ? 0 : first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
    std::uint32_t code = more == 0 ? first : first & (0x3FU >> more);
    bool good = first < 0x80 || (first >= 0xC2 && first < 0xF5);
    for (std::size_t i = 1; i <= more && good; ++i) {
        good = (byte(i) & 0xC0) == 0x80;
        code = code << 6 | (byte(i) & 0x3F);
    }
    constexpr std::array<std::uint32_t, 4> least{0, 0x80, 0x800, 0x10000};
    good = good && code >= least[more] && code < 0x110000 && (code < 0xD800 || code >= 0xE000);
    text.remove_prefix(good ? more + 1 : 1);
    return good ? code : 0xFFFD;
}

void append_string(std::string& out, std::string_view text) {
    if (text.empty()) return append_number(out, empty_length);
    std::string units;
    units.reserve(2 * text.size());
    while (!text.empty()) {
        const std::uint32_t code = next_code(text);
        if (code >= 0x10000) {
            append_number(units, static_cast<std::uint16_t>(0xD800 + ((code - 0x10000) >> 10)));
            append_number(units, static_cast<std::uint16_t>(0xDC00 + ((code - 0x10000) & 0x3FF)));
        } else {
            append_number(units, static_cast<std::uint16_t>(code));
        }
    }
    append_number(out, static_cast<std::uint32_t>(units.size()));
    out += units;
}

void append_type(std::string& out, Type type) {
    append_number(out, static_cast<std::uint32_t>(type));
    out.push_back('\0');
}

void append_fields(std::string& out, const Fields& fields, std::size_t count);

/// Appends the payload of one alternative of Value::Data, and its type before it.
struct Append {
    std::string& out;

    void operator()(std::monostate /*none*/) const { append_type(out, type_none); }
    void operator()(bool flag) const {
        append_type(out, type_bool);
        out.push_back(flag ? '\1' : '\0');
    }
    void operator()(std::int32_t number) const {
        append_type(out, type_int);
        append_number(out, static_cast<std::uint32_t>(number));
    }
    void operator()(std::uint32_t number) const {
        append_type(out, type_uint);
        append_number(out, number);
    }
    void operator()(std::uint64_t number) const {
        append_type(out, type_u64);
        append_number(out, number);
    }
    void operator()(double number) const {
        append_type(out, type_double);
        append_number(out, std::bit_cast<std::uint64_t>(number));
    }
    void operator()(const std::string& text) const {
        append_type(out, type_string);
        append_string(out, text);
    }
    void operator()(const Bytes& bytes) const {
        append_type(out, type_bytes);
        append_number(out, bytes.data.empty() ? empty_length : static_cast<std::uint32_t>(bytes.data.size()));
        out += bytes.data;
    }
    void operator()(const List& list) const {
        append_type(out, type_list);
        append_number(out, static_cast<std::uint32_t>(list.size()));
        for (const Value& value : list)
            std::visit(*this, value.data);
    }
    void operator()(const Fields& fields) const {
        append_type(out, type_hash);
        append_fields(out, fields, fields.size());
    }
};

void append_fields(std::string& out, const Fields& fields, std::size_t count) {
    append_number(out, static_cast<std::uint32_t>(count));
    for (const Field& field : fields) {
        append_string(out, field.name);
        std::visit(Append{out}, field.value.data);
    }
}

} // namespace

/// The part of the stream that is there.
class Decoder::Reader {
public:
    Reader(std::string_view text, std::size_t allowed) : text_(text), allowed_(allowed) {}

    std::size_t at = 0;

    /// Whether `count` more bytes are there. Throws Failure if the message may not have them.
    [[nodiscard]] bool has(std::size_t count) const {
        if (count > allowed_ - at)
            throw Failure(FailureCode::too_large, "a message is larger than the limit");
        return text_.size() - at >= count;
    }
    template<typename Unsigned>
    [[nodiscard]] bool number(Unsigned& out) {
        if (!has(sizeof out)) return false;
        out = 0;
        for (std::size_t i = 0; i < sizeof out; ++i)
            out =
                static_cast<Unsigned>(out << 8 * (sizeof out > 1) | static_cast<unsigned char>(text_[at++]));
        return true;
    }
    /// A length and so many bytes.
    [[nodiscard]] bool bytes(std::string_view& out) {
        std::uint32_t count = 0;
        if (!number(count)) return false;
        if (count == empty_length) count = 0;
        if (!has(count)) return false;
        out = text_.substr(at, count);
        at += count;
        return true;
    }
    [[nodiscard]] bool string(std::string& out) {
        std::string_view utf16;
        if (!bytes(utf16)) return false;
        if (utf16.size() % 2 != 0) throw broken("a string of an odd number of bytes");
        out = utf8_of(utf16);
        return true;
    }

private:
    std::string_view text_;
    std::size_t allowed_;
};

std::size_t Decoder::read(std::string_view text) {
    Reader reader(text, limits_.message_bytes - bytes_);
    std::size_t whole = 0;
    while (!complete_ && read_item(reader))
        whole = reader.at;
    bytes_ += whole;
    return whole;
}

bool Decoder::read_item(Reader& reader) {
    if (open_.empty()) return open(reader, true);
    Open& top = open_.back();
    if (top.is_map && !top.has_name) {
        if (!reader.string(top.name)) return false;
        top.has_name = true;
        return true;
    }
    return read_value(reader);
}

bool Decoder::read_value(Reader& reader) {
    std::uint32_t type = 0;
    std::uint8_t null = 0;
    if (!reader.number(type) || !reader.number(null)) return false;
    if (++values_ > limits_.values)
        throw Failure(FailureCode::too_large,
                      fmt::format("a message of more than {} values", limits_.values));
    std::uint8_t flag = 0;
    std::uint32_t number = 0;
    std::uint64_t wide = 0;
    std::string text;
    std::string_view bytes;
    // An item that is not all there is read again, and must not count twice.
    const auto wait = [this] { return --values_, false; };
    switch (type) {
    case type_none:
        return add({}), true;
    case type_bool:
        if (!reader.number(flag)) return wait();
        return add(flag != 0), true;
    case type_int:
        if (!reader.number(number)) return wait();
        return add(static_cast<std::int32_t>(number)), true;
    case type_uint:
        if (!reader.number(number)) return wait();
        return add(number), true;
    case type_u64:
        if (!reader.number(wide)) return wait();
        return add(wide), true;
    case type_double:
        if (!reader.number(wide)) return wait();
        return add(std::bit_cast<double>(wide)), true;
    case type_string:
        if (!reader.string(text)) return wait();
        return add(std::move(text)), true;
    case type_bytes:
        if (!reader.bytes(bytes)) return wait();
        return add(Bytes{std::string(bytes)}), true;
    case type_map:
    case type_hash:
    case type_list:
        return open(reader, type != type_list) || wait();
    default:
        throw broken(fmt::format("a value of type {}, allowed 0, 1, 2, 3, 5, 6, 8, 9, 10, 12 and 28", type));
    }
}

bool Decoder::open(Reader& reader, bool is_map) {
    std::uint32_t count = 0;
    if (!reader.number(count)) return false;
    if (open_.size() >= limits_.depth)
        throw Failure(FailureCode::too_large,
                      fmt::format("maps and lists nested deeper than {}", limits_.depth));
    if (count > limits_.values)
        throw Failure(FailureCode::too_large,
                      fmt::format("a list of {} values, allowed {} in a message", count, limits_.values));
    Open opened;
    opened.is_map = is_map;
    opened.left = count;
    if (is_map)
        opened.fields.reserve(std::min(count, max_reserved));
    else
        opened.list.reserve(std::min(count, max_reserved));
    open_.push_back(std::move(opened));
    close();
    return true;
}

void Decoder::add(Value value) {
    Open& top = open_.back();
    if (top.is_map) {
        top.fields.push_back({std::move(top.name), std::move(value)});
        top.has_name = false;
    } else {
        top.list.push_back(std::move(value));
    }
    --top.left;
    close();
}

void Decoder::close() {
    if (open_.back().left > 0) return;
    Open done = std::move(open_.back());
    open_.pop_back();
    if (!open_.empty()) return add(done.is_map ? Value(std::move(done.fields)) : Value(std::move(done.list)));
    message_ = std::move(done.fields);
    complete_ = true;
}

Fields Decoder::take() {
    complete_ = false;
    bytes_ = values_ = 0;
    return std::exchange(message_, {});
}

std::string encode(const Fields& message) {
    std::string out;
    append_fields(out, message, message.size());
    return out;
}

std::string encode(const Fields& message, std::string_view name, std::size_t size) {
    std::string out;
    append_fields(out, message, message.size() + 1);
    append_string(out, name);
    append_type(out, type_bytes);
    append_number(out, size == 0 ? empty_length : static_cast<std::uint32_t>(size));
    return out;
}

} // namespace obscura::service::compatible
