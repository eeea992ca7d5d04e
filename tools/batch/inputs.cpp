// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/inputs.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/time.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

namespace obscura::tools {
namespace {

PlannedInput planned(const std::filesystem::path& file) {
    PlannedInput input;
    input.file = file.string();
    input.whole = host::digest_of(file);
    if (input.whole.bytes > host::sampled_above) input.sampled_sha256 = host::sampled_digest_of(file).sha256;
    return input;
}

[[noreturn]] void changed(const std::string& file, const std::string& how) {
    throw InputError(fmt::format(
        "{}: {} since the batch was planned; bring the file back, or make a new plan", file, how));
}

void compare(const PlannedInput& input, InputCheck check) {
    const bool sampled = check == InputCheck::sampled && !input.sampled_sha256.empty();
    const host::FileDigest now = sampled ? host::sampled_digest_of(input.file) : host::digest_of(input.file);
    if (now.bytes != input.whole.bytes)
        changed(input.file, fmt::format("{} bytes instead of {}: changed", now.bytes, input.whole.bytes));
    if (now.sha256 != (sampled ? input.sampled_sha256 : input.whole.sha256))
        changed(input.file, "other bytes (SHA-256): changed");
}

} // namespace

void plan_inputs(const std::filesystem::path& file, const InputRecord& record, Plan& plan) {
    const std::filesystem::path scene = real_path(file);
    plan.scene = planned(scene);
    plan.assets.clear();
    for (const std::filesystem::path& asset : record.files())
        if (asset != scene) plan.assets.push_back(planned(asset));
}

CheckedInputs::Stamp CheckedInputs::stamp_of(const std::string& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0)
        throw InputError(fmt::format("{}: cannot be read: {}", file, std::strerror(errno)), errno);
    return {file, status.st_dev, status.st_ino, static_cast<std::uint64_t>(status.st_size),
            status.st_mtim.tv_sec * ns_per_s + status.st_mtim.tv_nsec};
}

CheckedInputs::CheckedInputs(const Plan& plan, InputCheck check) {
    const auto look = [&](const PlannedInput& input) {
        stamps_.push_back(stamp_of(input.file)); // before reading: a later change shows
        compare(input, check);
    };
    look(plan.scene);
    for (const PlannedInput& asset : plan.assets)
        look(asset);
}

void CheckedInputs::require_unchanged() const {
    for (const Stamp& before : stamps_) {
        const Stamp now = stamp_of(before.file);
        if (now.device != before.device || now.inode != before.inode || now.bytes != before.bytes ||
            now.written_ns != before.written_ns)
            throw InputError(
                fmt::format("{}: was written while frames were rendered from it; start again", before.file));
    }
}

} // namespace obscura::tools
