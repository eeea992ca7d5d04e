// SPDX-License-Identifier: Apache-2.0
// Makers of the verbs `obscura model ...`.
#pragma once

#include "tools/verbs/verb.hpp"

#include <memory>

namespace obscura::tools {

[[nodiscard]] std::unique_ptr<Verb> make_model_new();
[[nodiscard]] std::unique_ptr<Verb> make_model_list();
[[nodiscard]] std::unique_ptr<Verb> make_model_show();
[[nodiscard]] std::unique_ptr<Verb> make_model_check();
[[nodiscard]] std::unique_ptr<Verb> make_model_eval();
[[nodiscard]] std::unique_ptr<Verb> make_model_plot();
[[nodiscard]] std::unique_ptr<Verb> make_model_bench();

} // namespace obscura::tools
