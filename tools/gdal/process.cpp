// SPDX-License-Identifier: Apache-2.0
#include "tools/gdal/process.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/io/stop_reading.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

namespace obscura::tools {
namespace {

/// How often it is asked whether to stop.
constexpr std::int64_t stop_check_ms = 100;

/// Body of the child: becomes the helper.
[[noreturn]] void become_helper(const char* program, int in, int out, pid_t parent, std::uint64_t memory) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(70);
    const auto limit = [](auto resource, rlim_t value) {
        const rlimit both{value, value};
        setrlimit(resource, &both);
    };
    limit(RLIMIT_CORE, 0);
#ifndef OBSCURA_SANITIZED
    limit(RLIMIT_AS, memory);
#else
    (void)memory;
#endif
    // An interrupt is for obscura, which ends the helper in its own time.
    signal(SIGINT, SIG_IGN);
    const int null = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(in, STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    char name[] = "obscura-gdal";
    char* const arguments[] = {name, nullptr};
    execv(program, arguments);
    _exit(127);
}

} // namespace

std::filesystem::path gdal_helper() {
    std::error_code error;
    if (const char* named = std::getenv("OBSCURA_GDAL"); named != nullptr && *named != '\0')
        return std::filesystem::is_regular_file(named, error) ? named : std::filesystem::path{};
    const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    for (const std::filesystem::path& place :
         {here / "obscura-gdal", here.parent_path() / "libexec/obscura/obscura-gdal"})
        if (std::filesystem::is_regular_file(place, error)) return place;
    return {};
}

GdalProcess::GdalProcess(const GdalLimits& limits) : limits_(limits) {
    const std::filesystem::path program = gdal_helper();
    if (program.empty())
        throw Error(
            exit_hardware,
            "obscura import map: the program obscura-gdal is missing, which reads maps through GDAL: install Debian's package obscura-gdal, or run `scripts/build obscura-gdal` in a checkout");
    int requests[2], answers[2];
    if (pipe2(requests, O_CLOEXEC) != 0) throw Error(exit_software, "no pipe to obscura-gdal");
    FileDescriptor their_in(requests[0]);
    to_ = FileDescriptor(requests[1]);
    if (pipe2(answers, O_CLOEXEC) != 0) throw Error(exit_software, "no pipe from obscura-gdal");
    from_ = FileDescriptor(answers[0]);
    FileDescriptor their_out(answers[1]);
    // Fewer switches between the processes; a smaller pipe works too.
    fcntl(from_.get(), F_SETPIPE_SZ, 1 << 20);
    fcntl(to_.get(), F_SETFL, O_NONBLOCK);
    fcntl(from_.get(), F_SETFL, O_NONBLOCK);
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ < 0)
        throw Error(exit_software, fmt::format("obscura-gdal cannot be started: {}", std::strerror(errno)));
    if (pid_ == 0)
        become_helper(program.c_str(), their_in.get(), their_out.get(), parent, limits_.memory_bytes);
}

GdalProcess::~GdalProcess() {
    stop();
}

void GdalProcess::stop() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL); // it holds nothing that needs an orderly end
    while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
}

std::string GdalProcess::name_of_file(std::uint32_t id) const {
    return id < names_.size() ? names_[id] : "obscura-gdal";
}

void GdalProcess::lost(const std::string& name) {
    int status = 0;
    std::string how = "has ended";
    if (pid_ > 0) {
        // The pipe closes a moment before the process is gone.
        for (int i = 0; i < 200 && waitpid(pid_, &status, WNOHANG) == 0; ++i)
            usleep(5000);
        if (WIFSIGNALED(status))
            how = fmt::format("was ended by signal {}{}", WTERMSIG(status),
                              WTERMSIG(status) == SIGKILL ? " (killed, or out of memory)" : "");
        else if (WIFEXITED(status) && WEXITSTATUS(status) != 0)
            how = fmt::format("ended with status {}{}", WEXITSTATUS(status),
                              WEXITSTATUS(status) == 127 ? " (it cannot be started)" : "");
    }
    stop();
    throw InputError(fmt::format("{}: obscura-gdal, which reads it, {}", name, how));
}

void GdalProcess::wait(int fd, short events, const std::string& name) {
    for (;;) {
        const auto left =
            std::chrono::ceil<std::chrono::milliseconds>(deadline_ - std::chrono::steady_clock::now());
        if (left.count() <= 0) {
            stop();
            throw InputError(
                fmt::format("{}: obscura-gdal has not answered within {} s and was ended (--time-limit)",
                            name, std::chrono::duration<double>(limits_.answer).count()));
        }
        pollfd wanted{fd, events, 0};
        const int n = poll(&wanted, 1, static_cast<int>(std::min<std::int64_t>(left.count(), stop_check_ms)));
        try {
            check_reading();
        } catch (const ReadingStopped&) {
            stop(); // what it still sends answers nothing
            throw;
        }
        if (n > 0) return;
        if (n < 0 && errno != EINTR) lost(name);
    }
}

void GdalProcess::send(std::string_view bytes, const std::string& name) {
    while (!bytes.empty()) {
        const ssize_t done = write(to_.get(), bytes.data(), bytes.size());
        if (done > 0)
            bytes.remove_prefix(static_cast<std::size_t>(done));
        else if (done < 0 && errno == EAGAIN)
            wait(to_.get(), POLLOUT, name);
        else if (errno != EINTR)
            lost(name);
    }
}

void GdalProcess::receive(void* to, std::size_t bytes, const std::string& name) {
    char* at = static_cast<char*>(to);
    while (bytes > 0) {
        const ssize_t done = ::read(from_.get(), at, bytes);
        if (done > 0) {
            at += done;
            bytes -= static_cast<std::size_t>(done);
        } else if (done < 0 && errno == EAGAIN)
            wait(from_.get(), POLLIN, name);
        else if (done == 0 || errno != EINTR)
            lost(name);
    }
}

std::span<const std::byte> GdalProcess::ask(GdalMessage request, std::string_view body, GdalMessage wanted,
                                            const std::string& name) {
    if (pid_ <= 0) throw InputError(name + ": obscura-gdal has ended");
    deadline_ = std::chrono::steady_clock::now() + limits_.answer;
    // A helper that is gone is found by the answer that does not come.
    struct IgnorePipe {
        IgnorePipe() : before(signal(SIGPIPE, SIG_IGN)) {}
        ~IgnorePipe() { signal(SIGPIPE, before); }
        void (*before)(int);
    } const ignore;
    const GdalHeader header{request, 0, body.size()};
    send({reinterpret_cast<const char*>(&header), sizeof header}, name);
    send(body, name);
    GdalHeader answer;
    receive(&answer, sizeof answer, name);
    const auto confused = [&](std::string_view what) {
        stop();
        throw InputError(fmt::format("{}: obscura-gdal answers with {}", name, what));
    };
    if (answer.zero != 0 || answer.bytes > gdal_message_limit) confused("what is no answer");
    if (answer.kind != wanted && answer.kind != GdalMessage::refused) confused("something else");
    body_.resize(answer.bytes);
    receive(body_.data(), body_.size(), name);
    if (answer.kind == GdalMessage::refused)
        throw InputError(fmt::format("{}: GDAL cannot read it: {}", name,
                                     one_line({reinterpret_cast<const char*>(body_.data()), body_.size()})));
    return body_;
}

GdalMap GdalProcess::open(const std::filesystem::path& file) {
    require_regular_file(file);
    const std::string name = file.string();
    try {
        GdalMap map =
            decoded_map(ask(GdalMessage::open, absolute_path(file).string(), GdalMessage::opened, name));
        if (map.id != names_.size()) throw GdalProtocolError("the number of another file");
        names_.push_back(name);
        return map;
    } catch (const GdalProtocolError& error) {
        throw InputError(fmt::format("{}: obscura-gdal answers with {}", name, error.what()));
    }
}

std::span<const std::byte> GdalProcess::read(const GdalBlock& block, GdalType type) {
    const std::string name = name_of_file(block.id);
    const auto samples = ask(GdalMessage::read, encoded(block), GdalMessage::samples, name);
    if (samples.size() !=
        std::uint64_t{block.columns} * block.rows * bytes_of(block.mask ? GdalType::u8 : type))
        throw InputError(name + ": obscura-gdal answers with another number of samples");
    return samples;
}

std::vector<std::array<double, 2>> GdalProcess::transform(const GdalTransform& transform) {
    const std::string name = name_of_file(transform.id);
    const auto points = ask(GdalMessage::transform, encoded(transform), GdalMessage::points, name);
    if (points.size() != transform.points.size() * 16)
        throw InputError(name + ": obscura-gdal answers with another number of points");
    std::vector<std::array<double, 2>> out(transform.points.size());
    if (!out.empty()) std::memcpy(out.data(), points.data(), points.size());
    return out;
}

} // namespace obscura::tools
