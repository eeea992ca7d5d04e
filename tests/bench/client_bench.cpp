// SPDX-License-Identifier: Apache-2.0
// What calls of the rendering server cost its C, C++ and Octave clients, beside bare sockets in the same run.
//
// Prints a line of JSON for TCP and one for the Unix socket: microseconds, p50 and p99, of an empty call, a
// change of the scene, and a picture of 1024 x 1024 pixels of nothing (4 MiB). No verdict.
//
// Usage: client_bench OBSCURA [REPEATS [FOLDER-OF-THE-MEX-FUNCTION]]
#include "obscura_client.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/temp_folder.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using namespace obscura;
using nlohmann::json;

namespace {

constexpr std::size_t picture_bytes = 4U << 20;

/// Processor time of this thread.
double processor_us() {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

template<typename Work>
json times_us(int count, Work work) {
    std::vector<double> spent;
    const double used = processor_us();
    for (int i = 0; i < count; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        work(i);
        spent.push_back(
            std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
    }
    std::sort(spent.begin(), spent.end());
    return {{"p50", spent[spent.size() / 2]},
            {"p99", spent[spent.size() * 99 / 100]},
            {"processor", (processor_us() - used) / count}};
}

void receive(int socket, std::vector<char>& into) {
    for (std::size_t got = 0; got < into.size();) {
        const ssize_t more = ::recv(socket, into.data() + got, into.size() - got, 0);
        if (more <= 0) throw std::runtime_error("the other end of a socket has gone");
        got += static_cast<std::size_t>(more);
    }
}

void send(int socket, const std::vector<char>& from) {
    for (std::size_t sent = 0; sent < from.size();) {
        const ssize_t more = ::send(socket, from.data() + sent, from.size() - sent, MSG_NOSIGNAL);
        if (more <= 0) throw std::runtime_error("the other end of a socket has gone");
        sent += static_cast<std::size_t>(more);
    }
}

/// Two connected sockets, as the clients have them.
std::array<int, 2> bare_pair(bool tcp) {
    std::array<int, 2> ends{};
    if (!tcp) {
        if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) throw std::runtime_error("no sockets");
        return ends;
    }
    const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const name = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listener, name, size) != 0 || ::listen(listener, 1) != 0 ||
        ::getsockname(listener, name, &size) != 0)
        throw std::runtime_error("no listener");
    ends[0] = ::socket(AF_INET, SOCK_STREAM, 0);
    if (::connect(ends[0], name, size) != 0) throw std::runtime_error("no connection");
    ends[1] = ::accept(listener, nullptr, nullptr);
    ::close(listener);
    const int yes = 1;
    for (const int end : ends)
        ::setsockopt(end, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    return ends;
}

/// Round trips of 64 bytes, and answers of a picture, between two threads.
json floor_of(bool tcp, int repeats) {
    const std::array<int, 2> ends = bare_pair(tcp);
    std::thread other([&] {
        std::vector<char> asked(64);
        const std::vector<char> picture(picture_bytes);
        for (receive(ends[1], asked); asked[0] != 'e'; receive(ends[1], asked))
            send(ends[1], asked[0] == 'p' ? picture : asked);
    });
    std::vector<char> asked(64), small(64), large(picture_bytes);
    json result;
    result["bytes_64_us"] = times_us(repeats, [&](int) {
        send(ends[0], asked);
        receive(ends[0], small);
    });
    asked[0] = 'p';
    result["mib_4_us"] = times_us(std::max(repeats / 50, 10), [&](int) {
        send(ends[0], asked);
        receive(ends[0], large);
    });
    asked[0] = 'e';
    send(ends[0], asked);
    other.join();
    for (const int end : ends)
        ::close(end);
    return result;
}

json cpp_times(const std::string& address, int repeats) {
    auto camera = client::connect(address);
    json result;
    result["status_us"] = times_us(repeats, [&](int) { (void)camera.call("status"); });
    result["set_us"] = times_us(repeats, [&](int i) {
        camera.set("sun", {{"limb_darkening", 1.0 * i / repeats}});
    });
    camera.load_scene({});
    client::RenderOptions options;
    options.width = options.height = 1024;
    options.samples = 1;
    (void)camera.render(options);
    result["picture_us"] = times_us(std::max(repeats / 50, 10), [&](int) { (void)camera.render(options); });
    return result;
}

json c_times(const std::string& address, int repeats) {
    obscura_client* const camera = obscura_connect(address.c_str(), nullptr, nullptr);
    if (camera == nullptr) throw std::runtime_error("no connection");
    bool good = true;
    json result;
    result["status_us"] = times_us(repeats, [&](int) {
        obscura_answer* answer = nullptr;
        good = good && obscura_call(camera, "status", nullptr, &answer) == OBSCURA_OK;
        obscura_answer_free(answer);
    });
    result["set_us"] = times_us(repeats, [&](int i) {
        good = good &&
               obscura_set_number(camera, "sun", nullptr, "limb_darkening", 1.0 * i / repeats) == OBSCURA_OK;
    });
    good = good && obscura_load_scene(camera, obscura_map_new()) == OBSCURA_OK;
    obscura_render_options options{};
    options.width = options.height = 1024;
    options.samples = 1;
    result["picture_us"] = times_us(std::max(repeats / 50, 10), [&](int) {
        obscura_answer* answer = nullptr;
        good = good && obscura_render(camera, &options, &answer) == OBSCURA_OK;
        obscura_answer_free(answer);
    });
    obscura_close(camera);
    if (!good) throw std::runtime_error("a call failed");
    return result;
}

/// Octave prints its times itself.
json octave_times(const test::TempFolder& folder, const std::string& mex, const std::string& address,
                  int repeats) {
    const std::string source = OBSCURA_SOURCE_DIR;
    test::ChildProcess octave(folder.path(), "octave",
                              {"/usr/bin/octave-cli", "--no-init-file", "--path", source + "/clients/octave",
                               "--path", mex, source + "/tests/bench/client_bench.m", address,
                               std::to_string(repeats)});
    if (octave.wait(std::chrono::minutes(10)) != 0) throw std::runtime_error("octave-cli: " + octave.err());
    return json::parse(octave.out());
}

} // namespace

int main(int argc, char* argv[]) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: client_bench OBSCURA [REPEATS [FOLDER-OF-THE-MEX-FUNCTION]]\n");
        return 64;
    }
    const int repeats = argc > 2 ? std::max(std::atoi(argv[2]), 10) : 2000;
    const test::TempFolder folder;
    const std::string path = folder.path() / "socket";
    test::ChildProcess server(
        folder.path(), "server",
        {argv[1], "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", folder.path()});
    while (server.running() && server.out().find(path) == std::string::npos)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::string told = server.out(), begin = "listening at ";
    const std::string tcp = told.substr(begin.size(), told.find('\n') - begin.size());
    for (const std::string& address : {tcp, path}) {
        json line{{"over", address == tcp ? "TCP" : "Unix socket"},
                  {"bare_sockets", floor_of(address == tcp, repeats)},
                  {"c", c_times(address, repeats)},
                  {"cpp", cpp_times(address, repeats)}};
        if (argc > 3) line["octave"] = octave_times(folder, argv[3], address, repeats);
        std::array<double, 1> load{};
        if (::getloadavg(load.data(), 1) == 1) line["load"] = load[0];
        std::printf("%s\n", line.dump().c_str());
        std::fflush(stdout);
    }
}
