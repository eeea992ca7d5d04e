// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/parameters.hpp"

#include "core/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::serve::compatible {

using service::compatible::Fields;
using service::compatible::find;

Parameters::Parameters(Request& r, std::string_view only) : r_(r), only_(only) {
    const Value& value = r.arguments.value("parameters");
    fields_ = value.as<Fields>();
    double number = 0;
    if (fields_ != nullptr || value.as<std::monostate>() != nullptr) return;
    if (const List* const list = value.as<List>(); list != nullptr && list->empty()) return;
    if (only.empty() || !to_number(value, number))
        throw r.arguments.refused("parameters", "are no map", "a map of names and numbers");
    bare_ = &value;
    r.reply.warn(fmt::format("parameters: a number is taken for {}", only));
}

const Value* Parameters::value(std::string_view name) {
    used_.emplace_back(name);
    if (bare_ != nullptr) return name == only_ ? bare_ : nullptr;
    return fields_ == nullptr ? nullptr : find(*fields_, name);
}

double Parameters::number(std::string_view name, double otherwise, double least, double most) {
    const Value* const found = value(name);
    if (found == nullptr) return otherwise;
    double got = 0;
    if (!to_number(*found, got) || !(got >= least && got <= most))
        throw r_.arguments.refused("parameters", std::string(name),
                                   fmt::format("a number from {} to {}", least, most));
    return got;
}

Channels Parameters::channels_of(std::string_view name, double otherwise, double most) {
    Channels all{};
    all.fill(otherwise);
    const Value* const found = value(name);
    if (found == nullptr) return all;
    std::vector<double> got(1);
    if (to_number(*found, got[0]))
        got.resize(channels, got[0]);
    else if (!to_numbers(*found, got))
        got.clear();
    if (got.size() == 3) got.push_back((got[0] + got[1] + got[2]) / 3);
    if (got.size() != channels ||
        !std::all_of(got.begin(), got.end(), [&](double v) { return v >= 0 && v <= most; }))
        throw r_.arguments.refused("parameters", std::string(name),
                                   fmt::format("a number or {} of 0 to {}", channels, most));
    std::copy(got.begin(), got.end(), all.begin());
    return all;
}

void Parameters::check_rest() const {
    if (fields_ == nullptr) return;
    for (const auto& [name, value] : *fields_)
        if (std::find(used_.begin(), used_.end(), name) == used_.end())
            r_.reply.warn(fmt::format("parameters: \"{}\" has no effect", printable(name, 60)));
}

std::string model_name(const std::string& filename) {
    const std::string name = filename.substr(filename.find_last_of('/') + 1);
    return name.substr(0, name.find_last_of('.'));
}

} // namespace obscura::serve::compatible
