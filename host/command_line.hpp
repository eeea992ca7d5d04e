// SPDX-License-Identifier: Apache-2.0
// Declaration of a verb's command-line arguments: parsing, checks and --help; hides the parsing library.
#pragma once

#include "core/error.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::host {

/// Variable that receives the value of an option; its value before parse() is the default.
using OptionTarget = std::variant<bool*, std::int32_t*, std::uint32_t*, std::uint64_t*, double*, std::string*,
                                  std::vector<std::string>*>;

/// One option or positional argument of a verb.
struct Option {
    /// "-o,--output", "--frames"; for a positional argument the name in capitals.
    std::string names;
    OptionTarget target;    ///< bool: a flag; vector: may be given several times
    std::string value_name; ///< "FILE", "HZ"; empty for flags
    std::string help;
    double min = 0, max = 0;          ///< checked when max > min
    std::vector<std::string> choices; ///< checked when not empty
    bool required = false;
    bool positional = false;
    std::string without_value{}; ///< what the option means without a value; empty: it needs one
};

/// Bad command line: exit 64.
class UsageError : public Error {
public:
    explicit UsageError(const std::string& line) : Error(exit_usage, line) {}
};

/// Arguments of one verb, declared once; parsing, --help, man pages and shell completion are made from them.
struct CommandLine {
    std::string program = "obscura "; ///< program name before the verb
    std::string summary;              ///< one line
    std::string description;          ///< paragraphs
    std::vector<Option> options;
    std::vector<std::string> examples; ///< "obscura render ...  # what it does"

    /// Declare an argument each and return it for further settings. Targets must outlive parse().
    Option& positional(std::string name, OptionTarget target, std::string help);
    Option& option(std::string names, OptionTarget target, std::string value_name, std::string help);
    Option& number(std::string names, OptionTarget target, std::string value_name, std::string help,
                   double min, double max);
    Option& flag(std::string names, bool& target, std::string help);

    /// Fills the targets from `arguments` (without program and verb). Returns false when --help was given and
    /// has been printed. Throws UsageError.
    [[nodiscard]] bool parse(std::string_view verb, const std::vector<std::string>& arguments) const;
    /// Text of --help.
    [[nodiscard]] std::string help(std::string_view verb) const;
};

/// Throws UsageError unless the name of `file` ends in one of `endings`, such as ".png". `option`:
/// "--output", as it stands in the message.
void require_ending(std::string_view option, const std::filesystem::path& file,
                    const std::vector<std::string_view>& endings);

/// Parses "WxH" as two positive numbers. Throws UsageError.
void parse_size(std::string_view text, std::int32_t& width, std::int32_t& height);

} // namespace obscura::host
