// SPDX-License-Identifier: Apache-2.0
#include "tools/check/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace obscura::tools {

void Report::add(std::string_view key, std::string_view label, std::int64_t value) {
    lines_.push_back({std::string(key), std::string(label), fmt::format("{}", value), value});
}

void Report::add(std::string_view key, std::string_view label, std::string_view value) {
    lines_.push_back({std::string(key), std::string(label), std::string(value), std::string(value)});
}

void Report::add(std::string_view key, std::string_view label, bool value) {
    lines_.push_back({std::string(key), std::string(label), value ? "yes" : "no", value});
}

void Report::add(std::string_view key, std::string_view label, std::optional<double> value,
                 std::string_view unit, int decimals) {
    Line line{std::string(key), std::string(label), "-", {}};
    if (value && std::isfinite(*value)) {
        line.text = fmt::format("{:.{}f}{}{}", *value, decimals, unit.empty() ? "" : " ", unit);
        line.value = *value;
    }
    lines_.push_back(std::move(line));
}

void Report::add(std::string_view key, std::string_view label, std::string text, double value) {
    Line line{std::string(key), std::string(label), std::move(text), {}};
    if (std::isfinite(value)) line.value = value;
    lines_.push_back(std::move(line));
}

void Report::add_line(std::string_view label, std::string_view text) {
    lines_.push_back({"", std::string(label), std::string(text), std::string(text)});
}

void Report::add_object(std::string_view key, std::string_view json) {
    objects_.push_back({std::string(key), std::string(json)});
}

std::string Report::table() const {
    std::size_t label_width = 0, text_width = 0;
    for (const Line& line : lines_) {
        label_width = std::max(label_width, line.label.size());
        if (!std::holds_alternative<std::string>(line.value))
            text_width = std::max(text_width, line.text.size());
    }
    std::string out;
    for (const Line& line : lines_)
        out += std::holds_alternative<std::string>(line.value)
                   ? fmt::format("{:<{}}  {}\n", line.label, label_width, line.text)
                   : fmt::format("{:<{}}  {:>{}}\n", line.label, label_width, line.text, text_width);
    return out;
}

std::string Report::json() const {
    nlohmann::ordered_json object = nlohmann::ordered_json::object();
    for (const Line& line : lines_) {
        if (line.key.empty()) continue;
        std::visit(
            [&](const auto& value) {
                if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::monostate>)
                    object[line.key] = nullptr;
                else
                    object[line.key] = value;
            },
            line.value);
    }
    for (const Object& added : objects_)
        object[added.key] = nlohmann::ordered_json::parse(added.json);
    return object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void Report::print(bool as_json) const {
    std::fputs((as_json ? json() : table()).c_str(), stdout);
    std::fflush(stdout);
}

std::optional<double> percentile(std::vector<double> values, double percent) {
    if (values.empty()) return std::nullopt;
    const double rank = std::ceil(percent / 100 * static_cast<double>(values.size()));
    const auto index = std::min(values.size() - 1, static_cast<std::size_t>(std::max(0.0, rank - 1)));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
    return values[index];
}

} // namespace obscura::tools
