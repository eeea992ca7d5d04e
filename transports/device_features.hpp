// SPDX-License-Identifier: Apache-2.0
// Features of a camera as a client of its control protocol finds them, to be listed and set beside that
// client.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::transports {

/// Features by the names of the protocol's own description. All members are called within
/// Transport::run_between_commands().
class DeviceFeatures {
public:
    /// none: of a command, or not readable.
    using Value = std::variant<std::monostate, bool, std::int64_t, double, std::string>;
    struct Row {
        std::string name; ///< of an item of several with the item in brackets
        std::string_view category, type, unit, help;
        std::string_view visibility; ///< "Beginner", "Expert", "Guru"
        Value value{};
        std::optional<double> minimum{}, maximum{}, increment{};
        std::vector<std::string_view> entries{}; ///< of an enumeration
        bool writable = false;                   ///< or a command
        bool locked = false;                     ///< not while it acquires
    };

    virtual ~DeviceFeatures() = default;
    /// All of them, in the order of the description.
    [[nodiscard]] virtual std::vector<Row> list() = 0;
    /// Writes a feature, or with `true` runs a command. Returns why not, empty: done.
    [[nodiscard]] virtual std::string set(std::string_view name, const Value& value) = 0;
};

} // namespace obscura::transports
