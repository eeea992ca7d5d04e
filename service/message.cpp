// SPDX-License-Identifier: Apache-2.0
#include "service/message.hpp"

#include "core/text/utf8.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::service {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are sent as they stand in memory");

using nlohmann::json;

constexpr std::string_view magic = "OBSC";

template<typename Integer>
void append(std::string& out, Integer value) {
    for (std::size_t i = 0; i < sizeof value; ++i)
        out += static_cast<char>(value >> (8 * i) & 0xFF);
}

template<typename Integer>
Integer read(std::string_view text, std::size_t at) {
    Integer value = 0;
    for (std::size_t i = 0; i < sizeof value; ++i)
        value = static_cast<Integer>(value | static_cast<Integer>(static_cast<unsigned char>(text[at + i]))
                                                 << (8 * i));
    return value;
}

[[noreturn]] void refuse(const std::string& what) {
    throw Failure(FailureCode::bad_message, what);
}

/// Builds the head while the library parses; ends the parsing, and so its recursion, at the first violation.
class HeadBuilder final : public nlohmann::json_sax<json> {
public:
    explicit HeadBuilder(const Limits& limits) : limits_(limits) {}

    json head;
    std::string why; ///< empty: no violation

    bool null() override { return add(nullptr); }
    bool boolean(bool value) override { return add(value); }
    bool number_integer(number_integer_t value) override { return add(value); }
    bool number_unsigned(number_unsigned_t value) override {
        if (value > static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max()))
            return stop("an integer beyond 64 bits with sign");
        return add(static_cast<std::int64_t>(value));
    }
    bool number_float(number_float_t value, const string_t& /*text*/) override { return add(value); }
    bool string(string_t& value) override {
        return is_utf8(value) ? add(std::move(value)) : stop("a string that is not UTF-8");
    }
    bool binary(binary_t& /*value*/) override { return stop("binary data or an extension type"); }
    bool start_object(std::size_t /*elements*/) override { return open(json::object()); }
    bool start_array(std::size_t /*elements*/) override { return open(json::array()); }
    bool key(string_t& name) override {
        if (!is_utf8(name)) return stop("a key that is not UTF-8");
        if (open_.back()->contains(name))
            return stop(fmt::format("the key \"{}\" twice", name.substr(0, 60)));
        key_ = std::move(name);
        return true;
    }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }
    bool parse_error(std::size_t position, const std::string& /*token*/,
                     const nlohmann::detail::exception& /*error*/) override {
        return stop(fmt::format("no MessagePack, or its end, at byte {}", position));
    }

private:
    bool stop(std::string what) {
        if (why.empty()) why = std::move(what);
        return false;
    }
    /// Puts `value` where it belongs; null: there is no place for it.
    json* place(json value) {
        if (++values_ > limits_.head_values) {
            stop(fmt::format("more than {} values", limits_.head_values));
            return nullptr;
        }
        if (open_.empty()) {
            if (!value.is_object()) {
                stop("no map");
                return nullptr;
            }
            return &(head = std::move(value));
        }
        json& in = *open_.back();
        if (in.is_object()) return &(in[key_] = std::move(value));
        in.push_back(std::move(value));
        return &in.back();
    }
    bool add(json value) { return place(std::move(value)) != nullptr; }
    bool open(json container) {
        if (open_.size() >= limits_.head_depth)
            return stop(fmt::format("more than {} levels of maps and arrays", limits_.head_depth));
        json* const placed = place(std::move(container));
        if (placed != nullptr) open_.push_back(placed);
        return placed != nullptr;
    }
    bool close() {
        open_.pop_back();
        return true;
    }

    const Limits& limits_;
    /// Containers that are open. An element of an array does not move while it is open: only the array that
    /// is open last grows.
    std::vector<json*> open_;
    std::string key_;
    std::size_t values_ = 0;
};

} // namespace

std::string frame_text(const Frame& frame) {
    std::string out(magic);
    out += static_cast<char>(protocol_version);
    out += static_cast<char>(frame.kind);
    append(out, std::uint16_t{0});
    append(out, frame.id);
    append(out, frame.head_bytes);
    append(out, frame.body_bytes);
    return out;
}

Frame read_frame(std::string_view text, const Limits& limits) {
    if (text.substr(0, magic.size()) != magic)
        refuse("not a message of this protocol: it begins with \"OBSC\"");
    if (const auto version = static_cast<unsigned char>(text[4]); version != protocol_version)
        refuse(fmt::format("version {} of the protocol, allowed {}", version, protocol_version));
    const auto kind = static_cast<unsigned char>(text[5]);
    if (kind < static_cast<int>(MessageKind::request) || kind > static_cast<int>(MessageKind::error))
        refuse(fmt::format("kind {} of a message, allowed 1 to 4", kind));
    if (const auto flags = read<std::uint16_t>(text, 6); flags != 0)
        refuse(fmt::format("flags {} of a message, allowed 0", flags));
    const Frame frame{static_cast<MessageKind>(kind), read<std::uint32_t>(text, 8),
                      read<std::uint32_t>(text, 12), read<std::uint64_t>(text, 16)};
    if (frame.head_bytes > limits.head_bytes)
        throw Failure(FailureCode::too_large,
                      fmt::format("a head of {} bytes, allowed {}", frame.head_bytes, limits.head_bytes));
    if (frame.body_bytes > limits.body_bytes)
        throw Failure(FailureCode::too_large,
                      fmt::format("a body of {} bytes, allowed {}", frame.body_bytes, limits.body_bytes));
    return frame;
}

json read_head(std::string_view text, const Limits& limits) {
    HeadBuilder builder(limits);
    const bool whole =
        json::sax_parse(text.begin(), text.end(), &builder, nlohmann::detail::input_format_t::msgpack, true);
    if (!builder.why.empty()) refuse("head of a message: " + builder.why);
    if (!whole) refuse("head of a message: no MessagePack");
    return std::move(builder.head);
}

json head_of(const nlohmann::ordered_json& value) {
    json head;
    if (value.is_object()) {
        head = json::object();
        for (const auto& [name, member] : value.items())
            head[as_utf8(name)] = head_of(member);
    } else if (value.is_array()) {
        head = json::array();
        for (const nlohmann::ordered_json& element : value)
            head.push_back(head_of(element));
    } else if (value.is_string()) {
        head = as_utf8(value.get_ref<const std::string&>());
    } else if (!value.is_number_float() || std::isfinite(value.get<double>())) {
        head = value;
    }
    return head;
}

json list_arrays(const std::vector<Array>& arrays) {
    json rows = json::array();
    std::uint64_t offset = 0;
    for (const Array& array : arrays) {
        const std::uint64_t bytes = bytes_of(array).size();
        offset += padding(offset);
        rows.push_back({{"name", array.name},
                        {"dtype", dtype_of(array)},
                        {"shape", array.shape},
                        {"offset", offset},
                        {"codec", name_of(array.codec)},
                        {"bytes", bytes}});
        offset += bytes;
    }
    return rows;
}

Outgoing make_message(MessageKind kind, std::uint32_t id, json head, std::vector<Array> arrays) {
    std::uint64_t body_bytes = 0;
    for (const Array& array : arrays)
        body_bytes += padding(body_bytes) + bytes_of(array).size();
    if (!arrays.empty()) head["arrays"] = list_arrays(arrays);
    std::string packed;
    json::to_msgpack(head, packed);
    return {.start = frame_text({kind, id, static_cast<std::uint32_t>(packed.size()), body_bytes}) + packed,
            .arrays = std::move(arrays)};
}

} // namespace obscura::service
