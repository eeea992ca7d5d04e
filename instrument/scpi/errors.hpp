// SPDX-License-Identifier: Apache-2.0
// Error numbers of SCPI-1999 (volume 2, chapter 21) that this instrument reports, with their texts.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace obscura::instrument {

/// Its value is the number that SYSTem:ERRor? tells.
enum class ScpiCode : std::int16_t {
    no_error = 0,
    invalid_character = -101,
    syntax_error = -102,
    invalid_separator = -103,
    data_type_error = -104,
    parameter_not_allowed = -108,
    missing_parameter = -109,
    header_separator_error = -111,
    mnemonic_too_long = -112,
    undefined_header = -113,
    header_suffix_out_of_range = -114,
    invalid_character_in_number = -121,
    exponent_too_large = -123,
    too_many_digits = -124,
    invalid_suffix = -131,
    suffix_not_allowed = -138,
    character_data_too_long = -144,
    invalid_string_data = -151,
    block_data_not_allowed = -168,
    expression_data_not_allowed = -178,
    execution_error = -200,
    command_protected = -203,
    trigger_ignored = -211,
    settings_conflict = -221,
    data_out_of_range = -222,
    illegal_parameter_value = -224,
    data_stale = -230,
    hardware_missing = -241,
    queue_overflow = -350,
    input_buffer_overrun = -363,
    query_unterminated = -420,
};
constexpr auto enum_names(ScpiCode /*type*/) {
    using C = ScpiCode;
    return std::array{EnumName{C::no_error, "No error"},
                      EnumName{C::invalid_character, "Invalid character"},
                      EnumName{C::syntax_error, "Syntax error"},
                      EnumName{C::invalid_separator, "Invalid separator"},
                      EnumName{C::data_type_error, "Data type error"},
                      EnumName{C::parameter_not_allowed, "Parameter not allowed"},
                      EnumName{C::missing_parameter, "Missing parameter"},
                      EnumName{C::header_separator_error, "Header separator error"},
                      EnumName{C::mnemonic_too_long, "Program mnemonic too long"},
                      EnumName{C::undefined_header, "Undefined header"},
                      EnumName{C::header_suffix_out_of_range, "Header suffix out of range"},
                      EnumName{C::invalid_character_in_number, "Invalid character in number"},
                      EnumName{C::exponent_too_large, "Exponent too large"},
                      EnumName{C::too_many_digits, "Too many digits"},
                      EnumName{C::invalid_suffix, "Invalid suffix"},
                      EnumName{C::suffix_not_allowed, "Suffix not allowed"},
                      EnumName{C::character_data_too_long, "Character data too long"},
                      EnumName{C::invalid_string_data, "Invalid string data"},
                      EnumName{C::block_data_not_allowed, "Block data not allowed"},
                      EnumName{C::expression_data_not_allowed, "Expression data not allowed"},
                      EnumName{C::execution_error, "Execution error"},
                      EnumName{C::command_protected, "Command protected"},
                      EnumName{C::trigger_ignored, "Trigger ignored"},
                      EnumName{C::settings_conflict, "Settings conflict"},
                      EnumName{C::data_out_of_range, "Data out of range"},
                      EnumName{C::illegal_parameter_value, "Illegal parameter value"},
                      EnumName{C::data_stale, "Data corrupt or stale"},
                      EnumName{C::hardware_missing, "Hardware missing"},
                      EnumName{C::queue_overflow, "Queue overflow"},
                      EnumName{C::input_buffer_overrun, "Input buffer overrun"},
                      EnumName{C::query_unterminated, "Query UNTERMINATED"}};
}

/// A command that is not done. what() is the device-dependent part of the error's text; may be empty.
class ScpiError : public std::runtime_error {
public:
    explicit ScpiError(ScpiCode the_code, const std::string& detail = {})
        : std::runtime_error(detail), code(the_code) {}

    ScpiCode code;
};

} // namespace obscura::instrument
