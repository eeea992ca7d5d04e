// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/shard_runner.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/path_state.hpp"
#include "host/interrupt.hpp"
#include "images/writers/pending_file.hpp"
#include "renderer/scene_files/scene_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>
#include <string_view>
#include <utility>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace obscura::tools {
namespace {

/// Part of the names of temporary files, before host and process.
constexpr std::string_view temporary = ".tmp.";

/// A frame's file before it has its name; removed unless it gets it.
class TemporaryFrame {
public:
    TemporaryFrame(const std::filesystem::path& folder, const std::string& name, const std::string& host)
        : final_(folder / name), path_(folder / fmt::format("{}{}{}.{}", name, temporary, host, getpid())) {}
    ~TemporaryFrame() {
        if (!path_.empty()) ::unlink(path_.c_str());
    }
    TemporaryFrame(const TemporaryFrame&) = delete;
    TemporaryFrame& operator=(const TemporaryFrame&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// Brings the bytes to the disk, then gives the file its name: no crash leaves half a frame under it.
    void commit() {
        const FileDescriptor file(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
        if (!file || ::fsync(file.get()) != 0 || ::rename(path_.c_str(), final_.c_str()) != 0)
            throw OutputError(fmt::format("{}: cannot be written: {}", final_.string(), std::strerror(errno)),
                              errno);
        path_.clear();
    }

private:
    std::filesystem::path final_, path_;
};

/// Removes what killed processes left: a file has its temporary name for seconds only.
void remove_leftovers(const std::filesystem::path& folder) {
    std::error_code error;
    const auto long_ago = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
    for (const std::filesystem::path& entry : paths_in(folder, error))
        if (entry.filename().string().find(temporary) != std::string::npos &&
            std::filesystem::last_write_time(entry, error) < long_ago && !error)
            std::filesystem::remove(entry, error);
}

/// Scene of the plan with its render options.
scene::Scene load_planned_scene(const Plan& plan) {
    scene::Scene scene = scene::load_scene(plan.scene.file);
    plan.render.resize(scene);
    if (const std::size_t samples = scene.camera.motion.samples.size();
        plan.render.trajectory && samples < plan.frames.last)
        throw InputError(fmt::format("{}: the camera's trajectory has {} samples, the batch goes to frame {}",
                                     plan.scene.file, samples, plan.frames.last));
    return scene;
}

} // namespace

std::string host_name() {
    std::array<char, 256> name{};
    if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return "unknown";
    std::string out(name.data());
    for (char& c : out)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_' && c != '.') c = '_';
    return out;
}

std::string program_version() {
    return OBSCURA_VERSION;
}

ShardRunner::ShardRunner(Plan plan, std::filesystem::path batch, FrameCheck check, std::uint32_t threads)
    : plan_(std::move(plan)), batch_(std::move(batch)), check_(check), host_(host_name()) {
    if (plan_.version != program_version())
        throw InputError(fmt::format(
            "{}: version: made by Obscura {}, this is {}, whose frames can differ; run that version, or make a new plan",
            (batch_ / plan_name).string(), plan_.version, program_version()));
    plan_.render.settings.threads = threads;
    // A limit on the size of files is an error of the write, not the end of the process without a word.
    std::signal(SIGXFSZ, SIG_IGN);
}

void ShardRunner::prepare() {
    if (frames_) return;
    inputs_.emplace(plan_, InputCheck::sampled);
    frames_ =
        std::make_unique<SceneFrames>(load_planned_scene(plan_), plan_.render, (batch_ / plan_name).string());
}

bool ShardRunner::is_done(ShardRecords& records, std::uint64_t frame) const {
    records.update(); // others may have made it meanwhile
    const FrameRecord* const record = records.find(frame);
    return record != nullptr && explain_not_done(*record, records.folder(), check_).empty();
}

bool ShardRunner::run(std::uint64_t shard, const std::function<void()>& frame_done) {
    ShardRecords records(plan_, batch_, shard);
    const FrameRange frames = plan_.frames_of(shard);
    bool first = true;
    for (std::uint64_t frame = frames.first; frame <= frames.last; ++frame) {
        if (host::interrupted()) return false;
        if (is_done(records, frame)) {
            ++counts_.present;
        } else {
            if (std::exchange(first, false)) {
                images::make_writable(records.folder());
                remove_leftovers(records.folder());
                prepare();
            }
            if (!render(records, frame)) return false;
            ++counts_.rendered;
        }
        frame_done();
    }
    return true;
}

bool ShardRunner::render(const ShardRecords& records, std::uint64_t frame) {
    const auto start = std::chrono::steady_clock::now();
    frames_->begin(frame, plan_.render.time_of(frames_->camera(), frame));
    if (!frames_->render(0, [](std::int32_t /*rows*/) {})) return false;
    if (plan_.render.layers && !frames_->trace_aovs()) return false;
    FrameRecord record;
    record.frame = frame;
    record.file = plan_.file_name(frame);
    TemporaryFrame file(records.folder(), record.file, host_);
    frames_->write(file.path(), plan_.format);
    record.content = host::digest_of(file.path());
    inputs_->require_unchanged();
    file.commit();
    record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    record.finished_s = std::time(nullptr);
    record.host = host_;
    record.version = plan_.version;
    record.plan = plan_.id;
    append_record(records.folder() / records_name, record);
    return true;
}

} // namespace obscura::tools
