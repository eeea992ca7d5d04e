// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/model_files.hpp"

#include "core/error.hpp"
#include "models/model/model.hpp"
#include "models/values/model_values.hpp"
#include "serve/compatible/handlers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace obscura::serve::compatible {
namespace {

using nlohmann::json;

/// Value of a parameter as that of a key of a scene file. Throws Failure.
json key_value(Request& r, const models::Parameter& p, const Value& value) {
    const auto refuse = [&](std::string_view allowed) {
        throw r.arguments.refused("parameters", std::string(p.name), std::string(allowed));
    };
    if (p.type == models::Type::texture) {
        const auto* const file = value.as<std::string>();
        if (file == nullptr) refuse("the name of a texture");
        return texture_key(r, *file);
    }
    std::vector<double> numbers(1);
    if (!to_number(value, numbers[0]) && !to_numbers(value, numbers))
        refuse("a number, or one for each component");
    const auto count = static_cast<std::size_t>(models::components(p.type));
    if (numbers.size() == 1) numbers.resize(count, numbers[0]);
    if (numbers.size() != count) refuse(fmt::format("{} numbers", count));
    for (double& number : numbers)
        number /= p.si(); // keys are in the unit that the text names
    // A vec4 of one number stands for all bands, another one for each four of them.
    const bool same = std::all_of(numbers.begin(), numbers.end(), [&](double n) { return n == numbers[0]; });
    return count == 1 || (p.type == models::Type::vec4 && same) ? json(numbers[0]) : json(numbers);
}

} // namespace

nlohmann::json table_of_model(Request& r, const std::filesystem::path& file, std::string_view kind,
                              std::string_view wanted, Parameters& parameters) {
    try {
        const auto loaded = models::load_model(file.string(), kind);
        json table{{"model", file.string()}};
        const auto& known = loaded->model->parameters();
        for (std::size_t i = 0; i < known.size(); ++i)
            if (const Value* const value = parameters.value(known[i].name);
                value != nullptr && !known[i].global)
                table[loaded->keys[i]] = key_value(r, known[i], *value);
        return table;
    } catch (const Error& error) {
        throw r.arguments.refused("filename", r.client_state.files.without_folders(error.what()),
                                  std::string(wanted));
    }
}

} // namespace obscura::serve::compatible
