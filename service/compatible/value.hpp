// SPDX-License-Identifier: Apache-2.0
// Values of the compatible protocol: what Qt's QVariant holds in messages of the published client.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace obscura::service::compatible {

/// Bytes that are no text.
struct Bytes {
    std::string data;

    [[nodiscard]] bool operator==(const Bytes&) const = default;
};

struct Value;
struct Field;
using List = std::vector<Value>;
/// A hash or map: fields in the order of the message.
using Fields = std::vector<Field>;

/// A value; text is UTF-8. std::monostate: Python's None.
struct Value {
    using Data = std::variant<std::monostate, bool, std::int32_t, std::uint32_t, std::uint64_t, double,
                              std::string, Bytes, List, Fields>;

    // Defined where Field is complete, as Clang 14 wants it.
    Value();
    ~Value();
    Value(const Value& other);
    Value(Value&& other) noexcept;
    Value& operator=(const Value& other);
    Value& operator=(Value&& other) noexcept;
    /// From anything that Data has an alternative of, and from numbers and text in general.
    template<typename T>
    requires(!std::is_same_v<std::remove_cvref_t<T>, Value>) Value(T&& from)
        : data(std::forward<T>(from)) {} // NOLINT(google-explicit-constructor)
    Value(const char* text);             // NOLINT(google-explicit-constructor)
    Value(std::string_view text);        // NOLINT(google-explicit-constructor)

    Data data;

    template<typename T>
    [[nodiscard]] const T* as() const noexcept {
        return std::get_if<T>(&data);
    }
    [[nodiscard]] bool operator==(const Value& other) const;
};

struct Field {
    std::string name;
    Value value;

    [[nodiscard]] bool operator==(const Field&) const = default;
};

inline Value::Value() = default;
inline Value::~Value() = default;
inline Value::Value(const Value& other) = default;
inline Value::Value(Value&& other) noexcept = default;
inline Value& Value::operator=(const Value& other) = default;
inline Value& Value::operator=(Value&& other) noexcept = default;
inline Value::Value(const char* text) : data(std::string(text)) {}
inline Value::Value(std::string_view text) : data(std::string(text)) {}

inline bool Value::operator==(const Value& other) const {
    return data == other.data;
}

/// The field called `name`; null: none is.
[[nodiscard]] inline const Value* find(const Fields& fields, std::string_view name) noexcept {
    for (const Field& field : fields)
        if (field.name == name) return &field.value;
    return nullptr;
}

} // namespace obscura::service::compatible
