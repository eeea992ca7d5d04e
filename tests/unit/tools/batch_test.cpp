// SPDX-License-Identifier: Apache-2.0
// Batches: plan.json, records of frames, shards, commands for schedulers.
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "host/sha256.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/batch/batch_state.hpp"
#include "tools/batch/inputs.hpp"
#include "tools/batch/plan.hpp"
#include "tools/batch/records.hpp"
#include "tools/batch/submit.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

namespace batch_test {

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::ContainsSubstring;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"; // FIPS 180-4

Plan small_plan() {
    Plan plan;
    plan.version = "1.2.3";
    plan.scene = {"/scenes/a.toml", {3, abc}, ""};
    plan.assets = {{"/scenes/moon.obt", {std::uint64_t{1} << 40, abc}, abc}};
    plan.render.size = "16x16";
    plan.render.settings.seed = std::uint64_t{1} << 52;
    plan.render.step_s = 0.1;
    plan.frames = {101, 350};
    plan.shard_frames = 100;
    return plan;
}

std::string refusal(const std::string& text) {
    try {
        (void)parse_plan(text, "p");
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

std::string changed(const Json::json_pointer& place, const Json& value) {
    Json json = Json::parse(plan_text(small_plan()));
    json[place] = value;
    return refusal(json.dump());
}

FrameRecord record_of(const Plan& plan, std::uint64_t frame, const host::FileDigest& content) {
    return {frame, plan.file_name(frame), content, 2.5, 1000, "host", plan.version, plan.id};
}

} // namespace

TEST_CASE("SHA-256 is that of the standard") {
    CHECK(host::sha256_of("abc") == abc);
    CHECK(host::sha256_of("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    const test::TempFolder folder;
    const auto file = folder.write("million", std::string(1'000'000, 'a'));
    CHECK(host::digest_of(file) ==
          host::FileDigest{1'000'000, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"});
    CHECK(host::sampled_digest_of(file) == host::digest_of(file));
}

TEST_CASE("a large file's samples reach its first and its last byte") {
    const test::TempFolder folder;
    const auto file = folder.write("large", "");
    std::filesystem::resize_file(file, host::sampled_above + 12345);
    const std::string before = host::sampled_digest_of(file).sha256;
    for (const std::uint64_t at : {std::uint64_t{0}, host::sampled_above + 12344}) {
        std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
        out.seekp(static_cast<std::streamoff>(at));
        out.put('x');
        out.close();
        CHECK(host::sampled_digest_of(file).sha256 != before);
        std::fstream(file, std::ios::in | std::ios::out | std::ios::binary)
            .seekp(static_cast<std::streamoff>(at))
            .put('\0');
    }
    CHECK(host::sampled_digest_of(file).sha256 == before);
}

TEST_CASE("a plan that is written is read as it was") {
    const Plan plan = small_plan();
    const std::string text = plan_text(plan);
    const Plan again = parse_plan(text, "p");
    CHECK(plan_text(again) == text);
    CHECK(again.id == host::sha256_of(text));
    CHECK(again.render.step_s == 0.1);
    CHECK(again.render.settings.seed == plan.render.settings.seed);
    CHECK(again.assets.front().sampled_sha256 == abc);
}

TEST_CASE("shards divide all frames of a plan") {
    const Plan plan = small_plan();
    CHECK(plan.shards() == 3);
    CHECK(plan.frames_of(0) == FrameRange{101, 200});
    CHECK(plan.frames_of(2) == FrameRange{301, 350});
    CHECK(usual_shard_frames(10) == 100);
    CHECK(usual_shard_frames(46'000) == 100);
    CHECK(usual_shard_frames(1'000'001) == 1001);
    CHECK(plan.file_name(42) == "frame_000042.exr");
}

TEST_CASE("a bad plan is refused in one line that names place, cause and what is allowed") {
    const auto at = [](const char* place) { return Json::json_pointer(place); };
    CHECK(refusal("{").starts_with("p:1:2: not valid JSON: "));
    CHECK(refusal("{\n  \"format\": x}").starts_with("p:2:13: not valid JSON: "));
    CHECK(refusal("{\"a\": 1e900}") == "p: not valid JSON: number overflow parsing '1e900'");
    CHECK(refusal("[]") == "p: array, allowed is an object");
    CHECK(refusal("{}") == "p: format: is missing");
    CHECK(refusal(std::string(100'000, '[')).starts_with("p:1:100001: not valid JSON"));
    CHECK(refusal("\"\xff\"").starts_with("p:1:"));
    CHECK(changed(at("/format"), "x") == "p: format: \"x\": allowed is \"obscura batch plan\"");
    CHECK(changed(at("/format_version"), 2) == "p: format_version: 2: allowed is 1: make a new plan");
    CHECK(changed(at("/more"), 1).starts_with("p: more: is not known, allowed assets, format, "));
    CHECK(changed(at("/scene/file"), "../a.toml") ==
          "p: scene.file: \"../a.toml\": allowed is an absolute path without \".\" and \"..\"");
    CHECK(changed(at("/assets/0/file"), "/scenes/../../etc/shadow")
              .starts_with("p: assets[0].file: \"/scenes/../../etc/shadow\": allowed is an absolute path"));
    CHECK(changed(at("/scene/file"), std::string("/a\0b", 4)) ==
          "p: scene.file: \"/a\\u0000b\": has a NUL character");
    CHECK(changed(at("/scene/file"), "/a\nb") == "p: scene.file: \"/a\\nb\": has a control character");
    CHECK(changed(at("/scene/sha256"), "abc").ends_with("allowed are 64 hexadecimal digits, 0-9 and a-f"));
    CHECK(changed(at("/render/samples"), 0) == "p: render.samples: 0: allowed is a whole number, 1 to 65536");
    CHECK(changed(at("/render/samples"), 2.5).starts_with("p: render.samples: 2.5: allowed is a whole"));
    CHECK(changed(at("/render/samples"), "9").starts_with("p: render.samples: \"9\": allowed is a whole"));
    CHECK(changed(at("/render/seed"), -1).starts_with("p: render.seed: -1: allowed is a whole number"));
    CHECK(changed(at("/render/step_s"), 1e300).starts_with("p: render.step_s: 1e+300: allowed is a number"));
    CHECK(changed(at("/render/format"), "png") == "p: render.format: \"png\": allowed are exr and fits");
    CHECK_THAT(changed(at("/render/size"), "0x16"), ContainsSubstring("p: render.size: \"0x16\": "));
    CHECK(changed(at("/frames/last"), 100)
              .starts_with("p: frames.last: 100: allowed is a whole number, 101 to"));
    CHECK(changed(at("/shards/count"), 4) == "p: shards.count: 4: 250 frames in shards of 100 make 3");
    CHECK(changed(at("/shards/frames"), 0).starts_with("p: shards.frames: 0: allowed"));
    CHECK(changed(at("/assets"), 3) == "p: assets: 3: allowed is a list");
    CHECK(changed(at("/assets/0"), 3) == "p: assets[0]: number, allowed is an object");
    const std::string text = plan_text(small_plan());
    for (std::size_t end = 0; end + 2 < text.size(); ++end)
        CHECK(refusal(text.substr(0, end)).find('\n') == std::string::npos);
}

TEST_CASE("a record that is written is read as it was") {
    const FrameRecord record{7, "frame_000007.exr", {12, abc}, 0.1, 1'700'000'000, "a-b.c", "1.2", abc};
    const auto again = parse_record(record_text(record));
    REQUIRE(again);
    CHECK(record_text(*again) == record_text(record));
    for (const char* bad : {"", "{", "[]", "7", "{\"frame\": 1}"})
        CHECK(!parse_record(bad));
    Json json = Json::parse(record_text(record));
    json["frame"] = 1e300;
    CHECK(!parse_record(json.dump()));
}

TEST_CASE("a record after a line that was cut short counts, the line does not") {
    const test::TempFolder folder;
    const Plan plan = parse_plan(plan_text(small_plan()), "p");
    ShardRecords records(plan, folder.path(), 0);
    records.update();
    CHECK(records.all().empty());
    const std::string line = record_text(record_of(plan, 102, {5, abc}));
    const auto file = folder.write("shards/00000/shard.jsonl", line + "\n" + line.substr(0, 40));
    records.update();
    CHECK(records.all().size() == 1);
    append_record(file, record_of(plan, 103, {6, abc}));
    records.update();
    CHECK(records.all().size() == 2);
    REQUIRE(records.find(103) != nullptr);
    CHECK(records.find(103)->content.bytes == 6);
}

TEST_CASE("records of other plans, shards and files are left out") {
    const test::TempFolder folder;
    const Plan plan = parse_plan(plan_text(small_plan()), "p");
    const auto file = folder.write("shards/00000/shard.jsonl", "");
    FrameRecord record = record_of(plan, 102, {5, abc});
    record.plan = host::sha256_of("another");
    append_record(file, record);
    append_record(file, record_of(plan, 201, {5, abc})); // of shard 1
    record = record_of(plan, 103, {5, abc});
    record.file = "../../frame_000103.exr";
    append_record(file, record);
    ShardRecords records(plan, folder.path(), 0);
    records.update();
    CHECK(records.all().empty());
}

TEST_CASE("a frame counts as done only if record, size and hash agree") {
    const test::TempFolder folder;
    const Plan plan = parse_plan(plan_text(small_plan()), "p");
    const auto shard = shard_folder(folder.path(), 1);
    const auto file = folder.write("shards/00001/frame_000201.exr", "abc");
    const FrameRecord record = record_of(plan, 201, host::digest_of(file));
    append_record(shard / records_name, record);
    CHECK(explain_not_done(record, shard, FrameCheck::hash).empty());
    const BatchState state = batch_state(plan, folder.path(), FrameCheck::hash, 1010);
    CHECK(state.frames == 250);
    CHECK(state.done == 1);
    CHECK(state.shards_begun == 1);
    CHECK(state.unfinished == std::vector<std::uint64_t>{0, 1, 2});
    CHECK(state.work_left_s() == 249 * 2.5);

    (void)folder.write("shards/00001/frame_000201.exr", "abd");
    CHECK(explain_not_done(record, shard, FrameCheck::size).empty());
    CHECK(explain_not_done(record, shard, FrameCheck::hash) == "other bytes than recorded (SHA-256)");
    (void)folder.write("shards/00001/frame_000201.exr", "ab");
    CHECK(explain_not_done(record, shard, FrameCheck::size) == "2 bytes instead of 3");
    CHECK(batch_state(plan, folder.path(), FrameCheck::size, 1010, 2).bad.size() == 1);
    std::filesystem::remove(file);
    CHECK_THAT(explain_not_done(record, shard, FrameCheck::size), ContainsSubstring("cannot be read"));
    std::filesystem::create_symlink("/etc/passwd", file);
    CHECK(explain_not_done(record, shard, FrameCheck::size) == "not a regular file");
}

TEST_CASE("a frame of which records differ is reported") {
    const test::TempFolder folder;
    const Plan plan = parse_plan(plan_text(small_plan()), "p");
    const auto file = folder.write("shards/00000/frame_000101.exr", "abc");
    const auto records = shard_folder(folder.path(), 0) / records_name;
    append_record(records, record_of(plan, 101, {3, host::sha256_of("other")}));
    append_record(records, record_of(plan, 101, host::digest_of(file)));
    const BatchState state = batch_state(plan, folder.path(), FrameCheck::hash, 1010);
    REQUIRE(state.bad.size() == 1);
    CHECK(state.bad[0].why == "has been rendered with different bytes");
}

TEST_CASE("the time left follows from the frames of the last quarter of an hour") {
    BatchState state;
    state.frames = 1000, state.done = 400, state.seconds = 800, state.recent = 100, state.recent_s = 900;
    CHECK(state.left_s() == 5400);
    CHECK(state.work_left_s() == 1200);
    state.recent = state.done = 0;
    CHECK(!state.left_s());
    CHECK(!state.work_left_s());
}

TEST_CASE("inputs that a record lists go into the plan, and a changed one is refused") {
    const test::TempFolder folder;
    const auto scene = folder.write("a.toml", "scene");
    const auto numbers = folder.write("b.bin", "numbers");
    Plan plan = small_plan();
    {
        const InputRecord record;
        require_regular_file(scene);
        require_regular_file(numbers);
        require_regular_file(numbers);
        plan_inputs(scene, record, plan);
    }
    CHECK(plan.scene.file == std::filesystem::canonical(scene));
    REQUIRE(plan.assets.size() == 1);
    CHECK(plan.assets[0].file == std::filesystem::canonical(numbers));
    const CheckedInputs inputs(plan, InputCheck::whole);
    inputs.require_unchanged();
    (void)folder.write("b.bin", "other numbers");
    CHECK_THROWS_AS(inputs.require_unchanged(), InputError);
    CHECK_THROWS_WITH(CheckedInputs(plan, InputCheck::sampled),
                      numbers.string() +
                          ": 13 bytes instead of 7: changed since the batch was planned; bring "
                          "the file back, or make a new plan");
    (void)folder.write("b.bin", "numberz");
    CHECK_THROWS_WITH(CheckedInputs(plan, InputCheck::sampled), ContainsSubstring("other bytes (SHA-256)"));
    std::filesystem::remove(numbers);
    CHECK_THROWS_WITH(CheckedInputs(plan, InputCheck::sampled), ContainsSubstring("b.bin: "));
}

TEST_CASE("numbers are written as ranges and read back") {
    CHECK(ranges_text({0, 1, 2, 5, 7, 8}) == "0-2,5,7-8");
    CHECK(parse_ranges("7-8,0-2,5,8", 9, "x") == std::vector<std::uint64_t>{0, 1, 2, 5, 7, 8});
    for (const char* bad : {"", "9", "-1", "2-1", "1,,2", "1-", "a", "0x1", "18446744073709551616"})
        CHECK_THROWS_AS(parse_ranges(bad, 9, "x"), host::UsageError);
}

TEST_CASE("Slurm gets arrays of at most a thousand tasks, each obscura itself") {
    SubmitRequest request{"/usr/bin/obscura", "/data/my batch", {}, 2, 0, {"--time=1:00:00"}};
    CHECK(slurm_commands(request).empty());
    request.shards = {0, 1, 2, 999};
    CHECK(slurm_commands(request) ==
          std::vector<std::string>{
              "sbatch --array=0-2,999 --job-name=obscura --cpus-per-task=2 --signal=B:TERM@60 --requeue "
              "--output='/data/my batch/slurm-%A_%a.log' --time=1:00:00 --wrap='exec /usr/bin/obscura batch "
              "run "
              "'\\''/data/my batch'\\'' --threads 2 --shard $SLURM_ARRAY_TASK_ID'"});
    request.shards = {2000, 2005};
    REQUIRE(slurm_commands(request).size() == 1);
    CHECK_THAT(slurm_commands(request)[0],
               ContainsSubstring("--array=0,5 ") && ContainsSubstring("$((SLURM_ARRAY_TASK_ID + 2000))"));
}

TEST_CASE("GNU parallel gets the list of shards on its standard input") {
    const SubmitRequest request{"/usr/bin/obscura", "/data/b", {0, 1, 2, 7}, 1, 4, {}};
    CHECK(parallel_commands(request) ==
          std::vector<std::string>{
              "(seq 0 2; seq 7 7) | parallel --jobs 4 --joblog /data/b/parallel.log --halt "
              "soon,fail=3 '/usr/bin/obscura batch run /data/b --threads 1 --shard {}'"});
}

} // namespace batch_test
