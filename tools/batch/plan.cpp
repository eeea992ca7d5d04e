// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/plan.hpp"

#include "config/document.hpp"
#include "tools/batch/json_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view format_name = "obscura batch plan";
constexpr std::int64_t format_version = 1;
/// Size of plan.json, which bounds the memory that a parsed one takes.
constexpr std::uintmax_t max_plan_bytes = std::uintmax_t{16} << 20;
/// Largest whole number that JSON readers keep exactly.
constexpr std::uint64_t max_exact = std::uint64_t{1} << 53;

Json json_of(const PlannedInput& input) {
    Json json{{"file", input.file}, {"bytes", input.whole.bytes}, {"sha256", input.whole.sha256}};
    if (!input.sampled_sha256.empty()) json["sampled_sha256"] = input.sampled_sha256;
    return json;
}

std::string digest_in(JsonFields& fields, std::string_view key) {
    std::string text = fields.text(key);
    if (!host::is_sha256(text)) fields.refuse(key, "allowed are 64 hexadecimal digits, 0-9 and a-f");
    return text;
}

PlannedInput input_in(JsonFields fields) {
    PlannedInput input;
    input.file = fields.text("file");
    const std::filesystem::path path(input.file);
    if (!path.is_absolute() || path.lexically_normal() != path || input.file.ends_with('/'))
        fields.refuse("file", "allowed is an absolute path without \".\" and \"..\"");
    if (std::any_of(input.file.begin(), input.file.end(),
                    [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }))
        fields.refuse("file", "has a control character");
    input.whole.bytes = fields.whole("bytes", 0, max_exact);
    input.whole.sha256 = digest_in(fields, "sha256");
    if (input.whole.bytes > host::sampled_above) input.sampled_sha256 = digest_in(fields, "sampled_sha256");
    fields.end();
    return input;
}

Json json_of(const RenderOptions& options, SceneFileFormat format) {
    const renderer::RenderSettings& settings = options.settings;
    return {{"format", name_of(format)},        {"size", options.size},
            {"window", options.window},         {"samples", settings.samples_per_pixel},
            {"error", settings.target_error},   {"max_samples", settings.max_samples_per_pixel},
            {"bounces", settings.max_bounces},  {"seed", settings.seed},
            {"exposure_s", options.exposure_s}, {"trajectory", options.trajectory},
            {"time_s", options.time_s},         {"step_s", options.step_s},
            {"layers", options.layers}};
}

void read_render(JsonFields fields, Plan& plan) {
    RenderOptions& options = plan.render;
    renderer::RenderSettings& settings = options.settings;
    const auto format = enum_named<SceneFileFormat>(fields.text("format"));
    if (!format) fields.refuse("format", "allowed are exr and fits");
    plan.format = *format;
    options.size = fields.text("size");
    options.window = fields.text("window");
    try {
        options.check();
    } catch (const host::UsageError& error) {
        fields.refuse("size", error.what());
    }
    const auto whole = [&fields](std::string_view key, std::uint64_t least, std::uint64_t most) {
        return static_cast<std::uint32_t>(fields.whole(key, least, most));
    };
    settings.samples_per_pixel = whole("samples", 1, 65536);
    settings.target_error = fields.number("error", 0, 1);
    settings.max_samples_per_pixel = whole("max_samples", 1, 65536);
    settings.max_bounces = whole("bounces", 0, 1000);
    settings.seed = fields.whole("seed", 0, max_exact);
    options.exposure_s = fields.number("exposure_s", 0, 1e6);
    options.trajectory = fields.flag("trajectory");
    options.time_s = fields.number("time_s", -1e9, 1e9);
    options.step_s = fields.number("step_s", -1e9, 1e9);
    options.layers = fields.flag("layers");
    fields.end();
}

void read_frames(JsonFields fields, Plan& plan) {
    plan.frames.first = fields.whole("first", 1, max_frames);
    plan.frames.last = fields.whole("last", plan.frames.first, max_frames);
    fields.end();
}

void read_shards(JsonFields fields, Plan& plan) {
    plan.shard_frames = fields.whole("frames", 1, max_frames);
    const std::uint64_t stated = fields.whole("count", 1, max_shards);
    if (stated != plan.shards())
        fields.refuse("count", fmt::format("{} frames in shards of {} make {}", plan.frames.count(),
                                           plan.shard_frames, plan.shards()));
    fields.end();
}

} // namespace

FrameRange Plan::frames_of(std::uint64_t shard) const noexcept {
    const std::uint64_t first = frames.first + shard * shard_frames;
    return {first, std::min(frames.last, first + shard_frames - 1)};
}

std::string Plan::file_name(std::uint64_t frame) const {
    return fmt::format("frame_{:06}.{}", frame, name_of(format));
}

std::uint64_t usual_shard_frames(std::uint64_t frames) {
    return std::max<std::uint64_t>(100, (frames + 999) / 1000);
}

std::filesystem::path shard_folder(const std::filesystem::path& batch, std::uint64_t shard) {
    return batch / "shards" / fmt::format("{:05}", shard);
}

std::string plan_text(const Plan& plan) {
    Json assets = Json::array();
    for (const PlannedInput& asset : plan.assets)
        assets.push_back(json_of(asset));
    const Json json{{"format", format_name},
                    {"format_version", format_version},
                    {"version", plan.version},
                    {"scene", json_of(plan.scene)},
                    {"assets", std::move(assets)},
                    {"render", json_of(plan.render, plan.format)},
                    {"frames", {{"first", plan.frames.first}, {"last", plan.frames.last}}},
                    {"shards", {{"frames", plan.shard_frames}, {"count", plan.shards()}}}};
    return json.dump(2) + "\n";
}

Plan parse_plan(std::string_view text, const std::string& name) {
    const nlohmann::json json = parse_json(text, name);
    JsonFields fields(json, name, "");
    if (fields.text("format") != format_name)
        fields.refuse("format", fmt::format("allowed is \"{}\"", format_name));
    if (fields.whole("format_version", 0, max_exact) != format_version)
        fields.refuse("format_version", fmt::format("allowed is {}: make a new plan", format_version));
    Plan plan;
    plan.version = fields.text("version");
    plan.scene = input_in(fields.object("scene"));
    const std::size_t assets = fields.list("assets");
    for (std::size_t i = 0; i < assets; ++i)
        plan.assets.push_back(input_in(fields.element("assets", i)));
    read_render(fields.object("render"), plan);
    read_frames(fields.object("frames"), plan);
    read_shards(fields.object("shards"), plan);
    fields.end();
    plan.id = host::sha256_of(text);
    return plan;
}

Plan read_plan(const std::filesystem::path& batch) {
    const std::filesystem::path file = batch / plan_name;
    std::error_code error;
    if (const std::uintmax_t bytes = std::filesystem::file_size(file, error);
        !error && bytes > max_plan_bytes)
        throw InputError(
            fmt::format("{}: {} bytes, allowed are at most {}", file.string(), bytes, max_plan_bytes));
    std::string text;
    if (const std::string why = config::read_text(file, text); !why.empty())
        throw InputError(
            fmt::format("{}: cannot be opened: {}; obscura batch plan makes it", file.string(), why), errno);
    return parse_plan(text, file.string());
}

} // namespace obscura::tools
