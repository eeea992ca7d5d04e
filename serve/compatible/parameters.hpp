// SPDX-License-Identifier: Apache-2.0
// Parameters of the published client's models.
#pragma once

#include "serve/compatible/handlers.hpp"
#include "service/compatible/value.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::serve::compatible {

/// The argument `parameters` of a call. All members throw Failure.
class Parameters {
public:
    /// `only`: the parameter that a bare number instead of a map stands for; empty: none.
    explicit Parameters(Request& r, std::string_view only = {});

    /// Null: it is not given.
    [[nodiscard]] const Value* value(std::string_view name);
    /// A number, of a vector its first.
    [[nodiscard]] double number(std::string_view name, double otherwise, double least, double most);
    /// Numbers of the channels; a single one is that of all.
    [[nodiscard]] Channels channels_of(std::string_view name, double otherwise, double most);
    /// Warns of parameters that were not read.
    void check_rest() const;

private:
    Request& r_;
    std::string_view only_;
    const service::compatible::Fields* fields_ = nullptr;
    const Value* bare_ = nullptr;
    std::vector<std::string> used_;
};

/// The name of a model file without folders and the ending.
[[nodiscard]] std::string model_name(const std::string& filename);

} // namespace obscura::serve::compatible
