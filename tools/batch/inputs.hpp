// SPDX-License-Identifier: Apache-2.0
// Scene and assets of a batch: listing and hashing for the plan, and the check that they are still the same.
#pragma once

#include "core/io/input_file.hpp"
#include "tools/batch/plan.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// Gives `plan` the scene `file` and the assets, which are what `record` lists beside it. Throws
/// InputError.
void plan_inputs(const std::filesystem::path& file, const InputRecord& record, Plan& plan);

/// How closely inputs are compared with the plan.
enum class InputCheck {
    sampled, ///< size, and SHA-256 of sampled_digest_of(): seconds, however large they are
    whole,   ///< size, and SHA-256 of every byte
};

/// State of the plan's inputs as a run has found and accepted them. Thread-bound.
class CheckedInputs {
public:
    /// Throws InputError with one line for the first input that is missing or differs from the plan.
    CheckedInputs(const Plan& plan, InputCheck check);
    /// Throws InputError if an input was replaced or written since; looks at sizes and times only.
    void require_unchanged() const;

private:
    struct Stamp {
        std::string file;
        std::uint64_t device = 0, inode = 0, bytes = 0;
        std::int64_t written_ns = 0;
    };
    static Stamp stamp_of(const std::string& file);

    std::vector<Stamp> stamps_;
};

} // namespace obscura::tools
