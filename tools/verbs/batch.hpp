// SPDX-License-Identifier: Apache-2.0
// Verbs of `obscura batch`: many frames of a scene, in shards, on many machines.
#pragma once

#include "tools/verbs/verb.hpp"

#include <memory>
#include <string>

namespace obscura::tools {

/// The operand of all verbs but plan.
inline void declare_batch_folder(host::CommandLine& line, std::string& folder) {
    line.positional("DIR", &folder, "Folder of the batch, with plan.json");
}

[[nodiscard]] std::unique_ptr<Verb> make_batch_plan();
[[nodiscard]] std::unique_ptr<Verb> make_batch_run();
[[nodiscard]] std::unique_ptr<Verb> make_batch_status();
[[nodiscard]] std::unique_ptr<Verb> make_batch_verify();
[[nodiscard]] std::unique_ptr<Verb> make_batch_submit();

} // namespace obscura::tools
