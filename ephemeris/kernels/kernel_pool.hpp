// SPDX-License-Identifier: Apache-2.0
// Kernel pool: variables of SPICE text kernels (LSK, PCK, FK, SCLK, meta-kernels).
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// Variables by name, as NAIF's Kernel Required Reading has them: an assignment with `=` replaces what
/// another kernel gave, one with `+=` appends. Not thread-safe while kernels are read.
class KernelPool {
public:
    /// Values of a variable: numbers or strings.
    struct Variable {
        std::vector<double> numbers; ///< dates: s since J2000, without leap seconds
        std::vector<std::string> strings;
        std::string place; ///< "FILE:LINE: NAME" of the last assignment
    };

    /// Reads the data of a text kernel. Throws InputError with file and line; the pool may then hold a part
    /// of the file.
    void read(const std::filesystem::path& file);
    /// As read(), of `text`, with `file` for messages.
    void read_text(const std::string& text, const std::string& file);

    /// Null: not assigned.
    [[nodiscard]] const Variable* find(const std::string& name) const;
    [[nodiscard]] const std::map<std::string, Variable>& variables() const { return variables_; }

    /// Numbers of a variable, between `least` and `most` of them; empty: not assigned. Throws InputError for
    /// strings or other counts.
    [[nodiscard]] std::span<const double> numbers(const std::string& name, std::size_t least,
                                                  std::size_t most) const;
    [[nodiscard]] std::optional<double> number(const std::string& name) const;
    /// A whole number that fits into an int. Throws InputError otherwise.
    [[nodiscard]] std::optional<int> integer(const std::string& name) const;
    [[nodiscard]] std::optional<std::string> string(const std::string& name) const;

private:
    std::map<std::string, Variable> variables_;
};

/// Text without leading and trailing blanks, inner blanks single, in capitals: how names are compared.
[[nodiscard]] std::string kernel_name(std::string_view text);

} // namespace obscura::ephemeris
