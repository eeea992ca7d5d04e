// SPDX-License-Identifier: Apache-2.0
// Frames over a lossy cable: a camera and libaravis in two network namespaces, joined by a veth pair.
//
// Usage (root): gige_loss_bench [FRAMES]   (1000 for each cell of the matrix if not given)
//
// The kernel's netem is not everywhere, so the packets are left out by the camera's own fault rules, at the
// last place before the socket; leaders and trailers are never lost that way. Prints JSON.
#include "core/clock.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/gige.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>

using namespace obscura;
using namespace obscura::test;
using namespace obscura::transports::gige;

namespace {

const std::string tag = fmt::format("loss{}", getpid());

void shell(const std::string& command) {
    if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

/// Two namespaces, removed at the end.
struct Cable {
    Cable() {
        for (const char end : {'a', 'b'})
            shell(fmt::format("ip netns add {}{}", tag, end));
        shell(fmt::format("ip link add loss netns {0}a type veth peer name loss netns {0}b", tag));
        for (const auto& [end, address] : {std::pair{'a', "10.211.78.1"}, {'b', "10.211.78.2"}}) {
            shell(fmt::format("ip -n {}{} addr add {}/24 dev loss", tag, end, address));
            for (const char* link : {"lo", "loss"})
                shell(fmt::format("ip -n {}{} link set {} up", tag, end, link));
        }
    }
    ~Cable() {
        for (const char end : {'a', 'b'})
            if (std::system(fmt::format("ip netns del {}{}", tag, end).c_str()) != 0)
                std::puts("left behind");
    }
    static void enter(char end) {
        const int fd = open(fmt::format("/var/run/netns/{}{}", tag, end).c_str(), O_RDONLY | O_CLOEXEC);
        if (fd < 0 || setns(fd, CLONE_NEWNET) != 0) throw std::runtime_error("setns");
        close(fd);
    }
};

struct Cell {
    double percent;
    std::uint32_t burst;
    bool packet_socket;
};

constexpr std::int32_t side = 1024; // Mono16: 2 MB
constexpr double pace_mbit_s = 960; // 120 MB/s

/// The camera, in a process of its own until it is killed.
pid_t start_camera(const Cell& cell) {
    const pid_t child = fork();
    if (child != 0) return child;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
        Cable::enter('a');
        CameraLimits limits;
        limits.sensor_width = limits.sensor_height = side;
        MonotonicClock clock;
        PatternCamera source(limits, 24);
        source.set_blank(true);
        GigeSettings settings;
        settings.interface = "loss";
        settings.history_frames = 12;
        settings.throughput_limit_mbit_s = pace_mbit_s;
        FaultRule rule;
        rule.fault = Fault::lose;
        rule.percent = cell.percent;
        rule.burst = cell.burst;
        settings.faults = {rule};
        GigeCamera camera(settings, source, clock);
        source.set_transport(camera);
        camera.start();
        for (;;)
            pause();
    } catch (const std::exception& e) {
        std::fprintf(stderr, "camera: %s\n", e.what());
    }
    _exit(1);
}

nlohmann::json receive(const Cell& cell, int frames) {
    GigeClient client("10.211.78.1");
    if (cell.packet_socket) arv_camera_gv_set_stream_options(client.camera(), ARV_GV_STREAM_OPTION_NONE);
    client.set("AcquisitionFrameRate", 50.0);
    client.set("TriggerMode", "Off");
    client.open_stream(30);
    g_object_set(client.stream(), "frame-retention", 500'000U, nullptr);
    client.execute("AcquisitionStart");
    int complete = 0, incomplete = 0;
    while (complete + incomplete < frames) {
        auto buffer = client.next();
        if (buffer == nullptr) break;
        (arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS ? complete : incomplete) += 1;
        client.give_back(std::move(buffer));
    }
    client.execute("AcquisitionStop");
    guint64 resent = 0, missing = 0;
    arv_gv_stream_get_statistics(ARV_GV_STREAM(client.stream()), &resent, &missing);
    return {{"loss_percent", cell.percent},
            {"burst_packets", cell.burst},
            {"receiver", cell.packet_socket ? "packet socket" : "UDP socket"},
            {"frames", complete + incomplete},
            {"incomplete", incomplete},
            {"resent_packets", resent},
            {"missing_packets", missing}};
}

} // namespace

int main(int argc, char* argv[]) {
    const int frames = argc > 1 ? std::atoi(argv[1]) : 1000;
    nlohmann::json report = nlohmann::json::array();
    bool good = true;
    try {
        const Cable cable;
        Cable::enter('b');
        for (const bool packet_socket : {false, true})
            for (const auto& [percent, burst] : {std::pair{0.1, 1U}, {1.0, 1U}, {5.0, 1U}, {1.0, 50U}}) {
                const Cell cell{percent, burst, packet_socket};
                const pid_t camera = start_camera(cell);
                for (int i = 0; i < 100; ++i) { // until it answers
                    GError* error = nullptr;
                    Object<ArvCamera> probe(arv_camera_new("10.211.78.1", &error));
                    g_clear_error(&error);
                    if (probe) break;
                    usleep(50'000);
                }
                const nlohmann::json result = receive(cell, frames);
                kill(camera, SIGKILL);
                waitpid(camera, nullptr, 0);
                const int allowed = percent <= 1 ? 0 : frames / 1000;
                good = good && result["frames"] == frames && result["incomplete"] <= allowed;
                report.push_back(result);
                std::cerr << result.dump() << "\n";
            }
    } catch (const std::exception& e) {
        std::cerr << e.what() << "\n";
        return 1;
    }
    std::cout << report.dump(2) << "\n";
    return good ? 0 : 1;
}
