// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: files of a batch. Whatever plan.json holds, it is a plan that is written and read again
// as it is, or refused in one line; whatever a line of shard.jsonl holds, it is a record or none.
//
// Input: a byte that chooses the file (even: plan.json), then its content.
#include "core/error.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "tools/batch/plan.hpp"
#include "tools/batch/records.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

using namespace obscura;
using test::require;

namespace {

void plan(std::string_view text) {
    try {
        const tools::Plan plan = tools::parse_plan(text, "plan.json");
        const std::uint64_t last = plan.shards() - 1;
        require(plan.frames_of(0).first == plan.frames.first &&
                plan.frames_of(last).last == plan.frames.last);
        require(std::filesystem::path(plan.scene.file).is_absolute());
        require(plan.scene.file.find("/../") == std::string::npos &&
                plan.scene.file.find('\0') == std::string::npos);
        const std::string again = tools::plan_text(plan);
        require(tools::plan_text(tools::parse_plan(again, "plan.json")) == again);
    } catch (const Error& error) {
        const std::string line = error.what();
        require(line.starts_with("plan.json:") && line.find('\n') == std::string::npos);
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
    if (data[0] % 2 == 0) {
        plan(text);
    } else if (const auto record = tools::parse_record(text)) {
        require(tools::parse_record(tools::record_text(*record)).has_value());
    }
    return 0;
}
