// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/inputs.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/time.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <set>

namespace obscura::tools {
namespace {

PlannedInput planned(const std::filesystem::path& file) {
    PlannedInput input;
    input.file = file.string();
    input.whole = digest_of(file);
    if (input.whole.bytes > sampled_above) input.sampled_sha256 = sampled_digest_of(file).sha256;
    return input;
}

/// Files beside a glTF file that hold its numbers. Meshes are read by a process of their own, which tells
/// nothing of the files that it opens.
void add_gltf_buffers(const std::filesystem::path& file, std::set<std::filesystem::path>& files) {
    if (file.extension() != ".gltf") return;
    std::string text;
    if (!config::read_text(file, text).empty()) return;
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object() || !json.contains("buffers")) return;
    for (const nlohmann::json& buffer : json["buffers"]) {
        if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
        std::error_code error;
        const auto beside =
            std::filesystem::canonical(file.parent_path() / buffer["uri"].get<std::string>(), error);
        if (!error && std::filesystem::is_regular_file(beside, error)) files.insert(beside);
    }
}

[[noreturn]] void changed(const std::string& file, const std::string& how) {
    throw InputError(fmt::format(
        "{}: {} since the batch was planned; bring the file back, or make a new plan", file, how));
}

void compare(const PlannedInput& input, InputCheck check) {
    const bool sampled = check == InputCheck::sampled && !input.sampled_sha256.empty();
    const FileDigest now = sampled ? sampled_digest_of(input.file) : digest_of(input.file);
    if (now.bytes != input.whole.bytes)
        changed(input.file, fmt::format("{} bytes instead of {}: changed", now.bytes, input.whole.bytes));
    if (now.sha256 != (sampled ? input.sampled_sha256 : input.whole.sha256))
        changed(input.file, "other bytes (SHA-256): changed");
}

} // namespace

void plan_inputs(const std::filesystem::path& file, const InputRecord& record, Plan& plan) {
    const std::filesystem::path scene = std::filesystem::canonical(file);
    std::set<std::filesystem::path> files;
    for (const std::filesystem::path& one : record.files()) {
        files.insert(one);
        add_gltf_buffers(one, files);
    }
    files.erase(scene);
    plan.scene = planned(scene);
    plan.assets.clear();
    for (const std::filesystem::path& asset : files)
        plan.assets.push_back(planned(asset));
}

CheckedInputs::Stamp CheckedInputs::stamp_of(const std::string& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0)
        throw InputError(fmt::format("{}: cannot be read: {}", file, std::strerror(errno)));
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
