// SPDX-License-Identifier: Apache-2.0
// Makers of the verbs `obscura texture ...`.
#pragma once

#include "tools/verbs/verb.hpp"

#include <memory>

namespace obscura::tools {

[[nodiscard]] std::unique_ptr<Verb> make_texture_info();
[[nodiscard]] std::unique_ptr<Verb> make_texture_sample();
[[nodiscard]] std::unique_ptr<Verb> make_texture_check();
[[nodiscard]] std::unique_ptr<Verb> make_texture_export();
[[nodiscard]] std::unique_ptr<Verb> make_texture_bake();
[[nodiscard]] std::unique_ptr<Verb> make_texture_mount();

} // namespace obscura::tools
