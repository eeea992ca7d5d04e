// SPDX-License-Identifier: Apache-2.0
// Arguments of a call of the published client, checked against the row of the call.
#pragma once

#include "service/compatible/commands.hpp"
#include "service/compatible/value.hpp"
#include "service/failure.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::service::compatible {

/// The client sends numbers as the type that they happened to have, so whole numbers are taken of any type of
/// number, and numbers of whole ones. Everything here throws Failure (bad_argument) with a line
/// "CALL: ARGUMENT: what, allowed ...".
class Arguments {
public:
    /// Throws if an argument is missing or of a wrong type. Both outlive this.
    Arguments(const Command& command, const Fields& message);

    /// Whether an argument that may be left out is there.
    [[nodiscard]] bool has(std::string_view name) const;
    [[nodiscard]] const std::string& text(std::string_view name) const;
    [[nodiscard]] bool flag(std::string_view name) const;
    /// Finite.
    [[nodiscard]] double number(std::string_view name) const;
    [[nodiscard]] double number(std::string_view name, double least, double most) const;
    [[nodiscard]] std::int64_t integer(std::string_view name, std::int64_t least, std::int64_t most) const;
    /// `count` finite numbers.
    [[nodiscard]] std::vector<double> vector(std::string_view name, std::size_t count) const;
    [[nodiscard]] const std::string& bytes(std::string_view name) const;
    [[nodiscard]] const Value& value(std::string_view name) const;

    /// What to throw for an argument.
    [[nodiscard]] Failure refused(std::string_view name, const std::string& what,
                                  const std::string& allowed) const;

private:
    const Command& command_;
    const Fields& message_;
};

/// A number of any type, NaN and infinite ones too; false: it is none.
[[nodiscard]] bool to_number(const Value& value, double& out) noexcept;
/// Numbers of a list; false: one of them is none.
[[nodiscard]] bool to_numbers(const Value& value, std::vector<double>& out);

} // namespace obscura::service::compatible
