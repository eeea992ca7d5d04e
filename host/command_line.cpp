// SPDX-License-Identifier: Apache-2.0
// Command-line parsing on CLI11; the only translation unit that includes it.
#include "host/command_line.hpp"

#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

namespace obscura::host {
namespace {

/// Breaks `text` into lines of at most `width` characters, each but the first indented by `indent`.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t width) {
    std::string out;
    std::size_t column = indent;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(' ', at), text.size());
        const std::size_t length = end - at;
        if (column + length > width && column > indent) {
            out += "\n" + std::string(indent, ' ');
            column = indent;
        } else if (column > indent) {
            out += ' ';
            ++column;
        }
        out += text.substr(at, length);
        column += length;
        at = end + 1;
    }
    return out;
}

std::string default_text(const OptionTarget& target) {
    return std::visit(
        [](auto* value) -> std::string {
            using T = std::remove_pointer_t<decltype(value)>;
            if constexpr (std::is_same_v<T, bool>)
                return {};
            else if constexpr (std::is_same_v<T, std::vector<std::string>>)
                return fmt::format("{}", fmt::join(*value, " "));
            else if constexpr (std::is_same_v<T, double>)
                return std::isnan(*value) ? std::string() : fmt::format("{}", *value); // NaN: not given
            else
                return fmt::format("{}", *value);
        },
        target);
}

std::string range_text(const Option& o) {
    const auto brief = [](double v) {
        return std::abs(v) < 1e7 ? fmt::format("{}", v) : fmt::format("{:g}", v);
    };
    return brief(o.min) + " to " + brief(o.max);
}

/// Empty when `text` is a number within the option's range.
std::string range_complaint(const Option& o, const std::string& text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc{} && end == text.data() + text.size() && value >= o.min && value <= o.max)
        return {};
    return fmt::format("\"{}\" is not allowed, allowed {}", text.substr(0, 60), range_text(o));
}

std::string choice_complaint(const Option& o, const std::string& text) {
    if (std::find(o.choices.begin(), o.choices.end(), text) != o.choices.end()) return {};
    return fmt::format("\"{}\" is not known, {}", text.substr(0, 60),
                       allowed_words(text, {o.choices.begin(), o.choices.end()}));
}

/// Message about arguments that match no option, with a suggestion.
std::string surplus_complaint(const std::vector<Option>& options, const std::vector<std::string>& surplus) {
    std::vector<std::string> names{"--help"};
    for (const Option& o : options)
        if (!o.positional) names.push_back(o.names.substr(o.names.rfind(',') + 1));
    const std::vector<std::string_view> known(names.begin(), names.end());
    for (const std::string& argument : surplus)
        if (argument.size() > 1 && argument[0] == '-') {
            const std::string name = argument.substr(0, std::min<std::size_t>(argument.find('='), 60));
            return fmt::format("unknown option \"{}\", {}", name, suggestion(name, known));
        }
    return fmt::format("unexpected argument \"{}\"", surplus.empty() ? "" : surplus.front().substr(0, 60));
}

/// `what` of CLI11 begins with the name of the option, as it is known by its longest name.
std::string missing_value_complaint(const std::vector<Option>& options, std::string_view what) {
    const std::string_view name = what.substr(0, what.find(':'));
    for (const Option& o : options)
        if (!o.positional && o.names.substr(o.names.rfind(',') + 1) == name)
            return fmt::format("{} needs a value, {}{}", name, o.value_name,
                               o.max > o.min ? fmt::format(" ({})", range_text(o)) : "");
    return std::string(what.substr(0, what.find('\n')));
}

} // namespace

Option& CommandLine::positional(std::string name, OptionTarget target, std::string text) {
    options.push_back({std::move(name), target, {}, std::move(text), 0, 0, {}, true, true});
    return options.back();
}

Option& CommandLine::option(std::string names, OptionTarget target, std::string value_name,
                            std::string text) {
    options.push_back(
        {std::move(names), target, std::move(value_name), std::move(text), 0, 0, {}, false, false});
    return options.back();
}

Option& CommandLine::number(std::string names, OptionTarget target, std::string value_name, std::string text,
                            double min, double max) {
    Option& added = option(std::move(names), target, std::move(value_name), std::move(text));
    added.min = min, added.max = max;
    return added;
}

Option& CommandLine::flag(std::string names, bool& target, std::string text) {
    return option(std::move(names), &target, {}, std::move(text));
}

bool CommandLine::parse(std::string_view verb, const std::vector<std::string>& arguments) const {
    CLI::App app(summary, std::string(verb));
    app.set_help_flag();
    bool help_wanted = false;
    app.add_flag("-h,--help", help_wanted);
    for (const Option& o : options) {
        CLI::Option* made = std::visit(
            [&](auto* value) -> CLI::Option* {
                using T = std::remove_pointer_t<decltype(value)>;
                if constexpr (std::is_same_v<T, bool>)
                    return app.add_flag(o.names, *value);
                else
                    return app.add_option(o.names, *value);
            },
            o.target);
        if (!o.without_value.empty()) made->expected(0, 1)->default_str(o.without_value);
        if (o.max > o.min) made->check([&o](const std::string& text) { return range_complaint(o, text); });
        if (!o.choices.empty())
            made->check([&o](const std::string& text) { return choice_complaint(o, text); });
        if (!std::holds_alternative<bool*>(o.target) &&
            !std::holds_alternative<std::vector<std::string>*>(o.target))
            made->take_last();
    }
    try {
        // CLI11 expects the arguments in reverse order.
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ExtrasError&) {
        throw UsageError(fmt::format("{0}{1}: {2} (try: {0}{1} --help)", program, verb,
                                     surplus_complaint(options, app.remaining())));
    } catch (const CLI::ArgumentMismatch& error) {
        throw UsageError(fmt::format("{0}{1}: {2} (try: {0}{1} --help)", program, verb,
                                     missing_value_complaint(options, error.what())));
    } catch (const CLI::ParseError& error) {
        std::string what = error.what();
        for (char& c : what)
            if (c == '\n') c = ' ';
        throw UsageError(fmt::format("{0}{1}: {2} (try: {0}{1} --help)", program, verb, what));
    }
    if (help_wanted) {
        std::fputs(help(verb).c_str(), stdout);
        return false;
    }
    for (const Option& o : options) {
        if (!o.required) continue;
        const std::string name = o.positional ? o.names : o.names.substr(o.names.rfind(',') + 1);
        const bool given = app.count(o.names.substr(0, o.names.find(','))) > 0;
        if (!given)
            throw UsageError(fmt::format("{0}{1}: {2} is missing (try: {0}{1} --help)", program, verb, name));
    }
    return true;
}

std::string CommandLine::help(std::string_view verb) const {
    std::string out = fmt::format("{0}{1} - {2}\n\nUsage: {0}{1}", program, verb, summary);
    for (const Option& o : options)
        if (o.positional) {
            const bool several = std::holds_alternative<std::vector<std::string>*>(o.target);
            const std::string name = o.names + (several ? "..." : "");
            out += o.required ? " " + name : fmt::format(" [{}]", name);
        }
    for (const Option& o : options)
        if (!o.positional && o.required)
            out += fmt::format(" {} {}", o.names.substr(0, o.names.find(',')), o.value_name);
    out += " [OPTION]...\n";
    if (!description.empty()) out += "\n" + wrapped(description, 0, 80) + "\n";
    out += "\n";
    constexpr std::size_t column = 30;
    const auto line = [&](std::string left, std::string_view right) {
        left = "  " + left;
        if (left.size() + 2 > column)
            left += "\n" + std::string(column, ' ');
        else
            left.resize(column, ' ');
        out += left + wrapped(right, column, 100) + "\n";
    };
    for (const Option& o : options) {
        std::string left = o.names;
        for (std::size_t at = 0; (at = left.find(',', at)) != std::string::npos; at += 2)
            left.replace(at, 1, ", ");
        if (!o.positional && left.rfind("--", 0) == 0) left = "    " + left;
        if (!o.value_name.empty())
            left += o.without_value.empty() ? " " + o.value_name : fmt::format(" [{}]", o.value_name);
        std::string right = o.help;
        if (!o.choices.empty()) right += fmt::format(" ({})", fmt::join(o.choices, " | "));
        if (o.max > o.min) right += fmt::format(" ({})", range_text(o));
        if (const std::string value = default_text(o.target); !o.required && !value.empty())
            right += fmt::format(" [{}]", value);
        line(left, right);
    }
    line("-h, --help", "Print this text");
    if (!examples.empty()) {
        out += "\nExamples:\n";
        for (const std::string& example : examples)
            out += "  " + example + "\n";
    }
    out +=
        "\n"
        "Exit status: 0 success; 1 incomplete (for example frames lost); 64 bad command line; 66 bad\n"
        "input file; 69 device, interface or daemon not available; 74 output cannot be written; 75 another\n"
        "client controls the camera; 77 not allowed; 78 bad configuration or refused value. "
        "Each error is\n"
        "one line on standard error.\n";
    return out;
}

void require_ending(std::string_view option, const std::filesystem::path& file,
                    const std::vector<std::string_view>& endings) {
    const std::string ending = file.extension().string();
    if (std::find(endings.begin(), endings.end(), ending) == endings.end())
        throw UsageError(fmt::format("{} {}: the ending of its name: {}", option, printable(file.string()),
                                     allowed_words(ending, endings)));
}

void parse_size(std::string_view text, std::int32_t& width, std::int32_t& height) {
    const auto number = [](std::string_view digits, std::int32_t& value) {
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        return error == std::errc{} && end == digits.data() + digits.size() && value >= 1 && value <= 65536;
    };
    const std::size_t x = text.find('x');
    if (x == std::string_view::npos || !number(text.substr(0, x), width) ||
        !number(text.substr(x + 1), height))
        throw UsageError(fmt::format(
            "--size: \"{}\" is not WIDTHxHEIGHT, for example 640x512; each 1 to 65536", text.substr(0, 60)));
}

} // namespace obscura::host
