// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/records.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "tools/batch/json_fields.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void fail_to_append(const std::filesystem::path& file, int error) {
    throw OutputError(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(error)));
}

/// Whether the file ends within a line, as after a write that was cut short.
bool ends_within_line(int fd) {
    const off_t end = ::lseek(fd, 0, SEEK_END);
    char last = '\n';
    return end > 0 && ::pread(fd, &last, 1, end - 1) == 1 && last != '\n';
}

} // namespace

std::string record_text(const FrameRecord& record) {
    const Json json{{"frame", record.frame},
                    {"file", record.file},
                    {"bytes", record.content.bytes},
                    {"sha256", record.content.sha256},
                    {"seconds", record.seconds},
                    {"finished_s", record.finished_s},
                    {"host", record.host},
                    {"version", record.version},
                    {"plan", record.plan}};
    return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

std::optional<FrameRecord> parse_record(std::string_view line) {
    try {
        const nlohmann::json json = parse_json(line, "");
        JsonFields fields(json, "", "");
        FrameRecord record;
        record.frame = fields.whole("frame", 1, max_frames);
        record.file = fields.text("file");
        record.content.bytes = fields.whole("bytes", 0, std::numeric_limits<std::int64_t>::max());
        record.content.sha256 = fields.text("sha256");
        record.seconds = fields.number("seconds", 0, 1e12);
        record.finished_s = static_cast<std::int64_t>(
            fields.whole("finished_s", 0, std::numeric_limits<std::int64_t>::max()));
        record.host = fields.text("host");
        record.version = fields.text("version");
        record.plan = fields.text("plan");
        if (!host::is_sha256(record.content.sha256)) return std::nullopt;
        return record;
    } catch (const InputError&) {
        return std::nullopt;
    }
}

void append_record(const std::filesystem::path& file, const FrameRecord& record) {
    const FileDescriptor out(::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
    if (!out) fail_to_append(file, errno);
    // What a killed writer, or a full disk, left of a line must not take this one with it.
    const std::string line = (ends_within_line(out.get()) ? "\n" : "") + record_text(record) + "\n";
    // One write: lines of several processes do not mix. Over a network they can; such lines are no records.
    const ssize_t written = ::write(out.get(), line.data(), line.size());
    if (written != static_cast<ssize_t>(line.size())) fail_to_append(file, written < 0 ? errno : ENOSPC);
}

ShardRecords::ShardRecords(const Plan& plan, const std::filesystem::path& batch, std::uint64_t shard)
    : plan_(&plan), frames_(plan.frames_of(shard)), folder_(shard_folder(batch, shard)) {}

void ShardRecords::update() {
    const std::filesystem::path file = folder_ / records_name;
    const FileDescriptor in(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (!in && errno == ENOENT) return;
    struct stat status {};
    if (!in || ::fstat(in.get(), &status) != 0)
        throw InputError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)), errno);
    if (!S_ISREG(status.st_mode)) throw InputError(fmt::format("{}: not a regular file", file.string()));
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (size < read_) read_ = 0; // it was written anew
    std::string text(size - read_, '\0');
    const ssize_t got =
        text.empty() ? 0 : ::pread(in.get(), text.data(), text.size(), static_cast<off_t>(read_));
    if (got < 0)
        throw InputError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)), errno);
    text.resize(static_cast<std::size_t>(got));
    std::string_view left = text;
    for (std::size_t end = 0; (end = left.find('\n')) != std::string_view::npos;) {
        take(left.substr(0, end));
        left.remove_prefix(end + 1);
        read_ += end + 1;
    }
}

void ShardRecords::take(std::string_view line) {
    std::optional<FrameRecord> record = parse_record(line);
    if (!record || record->plan != plan_->id) return;
    if (record->frame < frames_.first || record->frame > frames_.last) return;
    if (record->file != plan_->file_name(record->frame)) return;
    const std::uint64_t frame = record->frame;
    if (const FrameRecord* const before = find(frame);
        before != nullptr && before->content != record->content)
        disputed_.insert(frame);
    records_.insert_or_assign(frame, *std::move(record));
}

const FrameRecord* ShardRecords::find(std::uint64_t frame) const {
    const auto found = records_.find(frame);
    return found == records_.end() ? nullptr : &found->second;
}

std::string explain_not_done(const FrameRecord& record, const std::filesystem::path& folder,
                             FrameCheck check) {
    const std::filesystem::path file = folder / record.file;
    struct stat status {};
    if (::lstat(file.c_str(), &status) != 0) return fmt::format("cannot be read: {}", std::strerror(errno));
    if (!S_ISREG(status.st_mode)) return "not a regular file";
    if (static_cast<std::uint64_t>(status.st_size) != record.content.bytes)
        return fmt::format("{} bytes instead of {}", status.st_size, record.content.bytes);
    if (check == FrameCheck::hash) {
        try {
            if (host::digest_of(file).sha256 != record.content.sha256)
                return "other bytes than recorded (SHA-256)";
        } catch (const InputError& error) {
            return error.what();
        }
    }
    return {};
}

} // namespace obscura::tools
