// SPDX-License-Identifier: Apache-2.0
// A program that a test starts, watches and ends.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

extern char** environ;

namespace obscura::test {

/// Text of a file; empty when it is not there.
inline std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Started in the constructor with its output going to files; killed in the destructor if it still runs.
class ChildProcess {
public:
    using Clock = std::chrono::steady_clock;

    /// `arguments[0]` is the program. Output goes to `folder/NAME.out` and `folder/NAME.err`.
    ChildProcess(const std::filesystem::path& folder, const std::string& name,
                 const std::vector<std::string>& arguments, const std::vector<std::string>& environment = {})
        : out_(folder / (name + ".out")), err_(folder / (name + ".err")) {
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&actions, 1, out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        posix_spawn_file_actions_addopen(&actions, 2, err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        std::vector<char*> argv, envp;
        for (const std::string& a : arguments)
            argv.push_back(const_cast<char*>(a.c_str()));
        argv.push_back(nullptr);
        for (const std::string& e : environment)
            envp.push_back(const_cast<char*>(e.c_str()));
        for (char** e = environ; *e != nullptr; ++e)
            envp.push_back(*e);
        envp.push_back(nullptr);
        const int rc = posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), envp.data());
        posix_spawn_file_actions_destroy(&actions);
        if (rc != 0) throw std::runtime_error("cannot start " + arguments[0]);
    }
    ~ChildProcess() {
        if (!status_) {
            send(SIGKILL);
            int raw = 0;
            waitpid(pid_, &raw, 0);
        }
    }
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    [[nodiscard]] pid_t pid() const { return pid_; }
    void send(int signal) const { kill(pid_, signal); }
    [[nodiscard]] bool running() {
        if (!status_) poll();
        return !status_.has_value();
    }
    /// Exit status, 1000 + signal when killed by one, or nothing when it still runs after `limit`.
    std::optional<int> wait(std::chrono::milliseconds limit) {
        const Clock::time_point end = Clock::now() + limit;
        while (running() && Clock::now() < end)
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        return status_;
    }
    [[nodiscard]] std::string out() const { return text_of(out_); }
    [[nodiscard]] std::string err() const { return text_of(err_); }

private:
    void poll() {
        int raw = 0;
        if (waitpid(pid_, &raw, WNOHANG) != pid_) return;
        status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : 1000 + WTERMSIG(raw);
    }

    std::filesystem::path out_, err_;
    pid_t pid_ = -1;
    std::optional<int> status_;
};

} // namespace obscura::test
