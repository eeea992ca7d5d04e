// SPDX-License-Identifier: Apache-2.0
#include "images/readers/pds_label.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/text_file.hpp"
#include "core/text/number.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>

namespace obscura::images {
namespace {

constexpr std::string_view blank = " \t\r\n\f\v";

/// The value without quotes and without a unit in angle brackets.
std::string bare(std::string_view raw) {
    std::string_view text = trimmed(raw, blank);
    if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front())
        return std::string(text.substr(1, text.size() - 2));
    if (const auto unit = text.find('<');
        unit != std::string_view::npos && !text.empty() && text.front() != '(')
        text = trimmed(text.substr(0, unit), blank);
    return std::string(text);
}

/// Splits a label into statements.
class Scanner {
public:
    Scanner(const std::filesystem::path& file, std::string_view text) : file_(file), text_(text) {}

    /// Reads the next KEY = VALUE. Returns false at END or at the end of the text.
    bool next(std::string& key, std::string& value) {
        skip_blank();
        const std::size_t start = at_;
        while (at_ < text_.size() && text_[at_] != '=' && text_[at_] != '\n')
            ++at_;
        key = upper_case(trimmed(text_.substr(start, at_ - start), blank));
        if (key == "END" || key.empty()) return false;
        if (key == "END_OBJECT" || key == "END_GROUP") {
            if (at_ < text_.size() && text_[at_] == '=') read_value(value);
            return true;
        }
        if (at_ >= text_.size() || text_[at_] != '=') fail("a statement without \"=\"");
        read_value(value);
        return true;
    }

    [[noreturn]] void fail(std::string_view what) const {
        const auto line =
            1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
        throw InputError(fmt::format("{}:{}: not a PDS3 label: {}", file_.string(), line, what));
    }

private:
    void skip_blank() {
        while (at_ < text_.size()) {
            if (std::isspace(static_cast<unsigned char>(text_[at_])) != 0)
                ++at_;
            else if (text_.substr(at_, 2) == "/*")
                at_ = std::min(text_.find("*/", at_), text_.size() - 2) + 2;
            else
                return;
        }
    }
    /// Reads a value: from after "=" to the end of the line, of a quoted text or of a list.
    void read_value(std::string& value) {
        ++at_;
        skip_blank();
        const std::size_t start = at_;
        int depth = 0;
        char quote = 0;
        for (; at_ < text_.size(); ++at_) {
            const char c = text_[at_];
            if (quote != 0) {
                if (c == quote) quote = 0;
            } else if (c == '"' || c == '\'') {
                quote = c;
            } else if (c == '(' || c == '{') {
                ++depth;
            } else if (c == ')' || c == '}') {
                --depth;
            } else if (c == '\n' && depth <= 0) {
                // A unit may follow on a separate line.
                const std::size_t after = text_.find_first_not_of(" \t\r\n", at_);
                if (after == std::string_view::npos || text_[after] != '<') break;
                at_ = after - 1; // the blanks are looked at once
            } else if (text_.substr(at_, 2) == "/*" && depth <= 0) {
                break;
            }
        }
        if (quote != 0) fail("a text without its closing quote");
        if (depth > 0) fail("a list without its closing bracket");
        value = std::string(trimmed(text_.substr(start, at_ - start), blank));
    }

    const std::filesystem::path& file_;
    std::string_view text_;
    std::size_t at_ = 0;
};

} // namespace

PdsLabel::PdsLabel(const std::filesystem::path& file) : file_(file) {
    const InputFile in = open_input(file);
    // Read at most 1 MiB, more than any label has: an attached label is followed by its data.
    std::string text(std::size_t{1} << 20, '\0');
    text.resize(std::fread(text.data(), 1, text.size(), in.get()));
    Scanner scanner(file_, without_byte_order_mark(text));
    std::vector<std::string> objects;
    std::string key, value;
    while (scanner.next(key, value)) {
        if (key == "OBJECT" || key == "GROUP") {
            objects.push_back(upper_case(bare(value)));
            if (objects.size() > 32) scanner.fail("objects nested deeper than 32");
        } else if (key == "END_OBJECT" || key == "END_GROUP") {
            if (objects.empty()) scanner.fail(key + " without a beginning");
            objects.pop_back();
        } else {
            // Keywords of a FILE object describe the file and get no prefix, like those at the root of other
            // labels.
            const bool about_file =
                objects.empty() || objects.back() == "FILE" || objects.back() == "UNCOMPRESSED_FILE";
            values_.emplace(about_file ? key : objects.back() + "." + key, value);
        }
    }
    if (values_.find("PDS_VERSION_ID") == values_.end()) scanner.fail("no PDS_VERSION_ID");
}

const std::string& PdsLabel::text(std::string_view key) const {
    const auto found = values_.find(key);
    if (found == values_.end()) throw InputError(fmt::format("{}: the label has no {}", file_.string(), key));
    return found->second;
}

std::string PdsLabel::text(std::string_view key, std::string_view fallback) const {
    return bare(has(key) ? std::string_view(text(key)) : fallback);
}

std::int64_t PdsLabel::integer(std::string_view key) const {
    const std::string digits = bare(text(key));
    const std::optional<std::int64_t> value = whole_number(digits);
    if (!value)
        throw InputError(
            fmt::format("{}: {} is \"{}\", an integer is wanted", file_.string(), key, digits.substr(0, 60)));
    return *value;
}

std::int64_t PdsLabel::integer(std::string_view key, std::int64_t fallback) const {
    return has(key) ? integer(key) : fallback;
}

double PdsLabel::number(std::string_view key, double fallback) const {
    if (!has(key)) return fallback;
    const std::string digits = bare(text(key));
    const std::optional<double> value = decimal_number(digits);
    if (!value)
        throw InputError(
            fmt::format("{}: {} is \"{}\", a number is wanted", file_.string(), key, digits.substr(0, 60)));
    return *value;
}

std::vector<std::string> PdsLabel::list(std::string_view key) const {
    std::string_view inner = trimmed(text(key), blank);
    if (inner.empty() || (inner.front() != '(' && inner.front() != '{')) return {bare(inner)};
    inner = inner.substr(1, inner.size() - 2);
    std::vector<std::string> out;
    std::size_t start = 0;
    char quote = 0;
    for (std::size_t i = 0; i <= inner.size(); ++i) {
        if (i < inner.size() && quote != 0) {
            if (inner[i] == quote) quote = 0;
        } else if (i < inner.size() && (inner[i] == '"' || inner[i] == '\'')) {
            quote = inner[i];
        } else if (i == inner.size() || inner[i] == ',') {
            out.push_back(bare(inner.substr(start, i - start)));
            start = i + 1;
        }
    }
    return out;
}

std::string PdsLabel::unit(std::string_view key) const {
    const std::string& raw = text(key);
    const std::size_t open = raw.rfind('<'), end = raw.rfind('>');
    if (open == std::string::npos || end == std::string::npos || end < open) return {};
    return upper_case(trimmed(std::string_view(raw).substr(open + 1, end - open - 1), blank));
}

} // namespace obscura::images
