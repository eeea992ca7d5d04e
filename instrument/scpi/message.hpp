// SPDX-License-Identifier: Apache-2.0
// Parser of SCPI program messages: IEEE 488.2 headers and data elements of one line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::instrument {

/// One data element of a command.
struct Parameter {
    enum class Kind : std::uint8_t {
        number, ///< decimal, or #H, #Q, #B
        word,   ///< character data: MINimum, ON, Software
        string, ///< "..." or '...'
    };
    Kind kind = Kind::word;
    std::string text;   ///< of a word or a string; of a number as it was written, without its suffix
    double number = 0;  ///< finite
    std::string suffix; ///< unit of a number, in upper case; empty: none
};

/// One command of a message.
struct ProgramUnit {
    bool common = false;             ///< "*IDN?": the header is {"IDN"}
    bool query = false;              ///< ends with a question mark
    bool rooted = false;             ///< began with a colon
    std::vector<std::string> header; ///< mnemonics in upper case, with their numeric suffixes
    std::vector<Parameter> parameters;
};

/// Takes a program message apart, unit by unit. The text outlives it.
class MessageParser {
public:
    static constexpr std::size_t max_mnemonic = 12;   ///< IEEE 488.2, 7.6.1.4.1
    static constexpr std::size_t max_word_bytes = 64; ///< longer than the standard's 12, for SFNC names
    static constexpr std::size_t max_nodes = 8;       ///< of a header
    static constexpr std::size_t max_parameters = 16;

    /// `line`: without its terminator.
    explicit MessageParser(std::string_view line) : text_(line) {}

    /// The next unit; nullopt at the end. Throws ScpiError, after which the rest cannot be parsed.
    [[nodiscard]] std::optional<ProgramUnit> next();

private:
    [[nodiscard]] bool at_end() const noexcept { return place_ == text_.size(); }
    /// The next character; 0 at the end.
    [[nodiscard]] char peek() const noexcept { return at_end() ? '\0' : text_[place_]; }
    void skip_blanks();
    [[nodiscard]] std::string mnemonic();
    void header(ProgramUnit& unit);
    [[nodiscard]] Parameter parameter();
    [[nodiscard]] Parameter decimal();
    [[nodiscard]] Parameter based_number();
    [[nodiscard]] Parameter quoted();
    [[nodiscard]] Parameter word();

    std::string_view text_;
    std::size_t place_ = 0;
};

} // namespace obscura::instrument
