// SPDX-License-Identifier: Apache-2.0
// The camera beside Aravis's own simulator (ArvGvFakeCamera) on the loopback interface, 1024x1024 Mono16:
// frames per second, burst time, CPU per frame, jitter and trigger latency, as JSON on standard output.
//
//     gige_bench [--seconds S] [--realtime]
//
// Each device runs in a process of its own on the first core; the receiver, on the last, counts packets by
// kernel time stamps and reads no pixel. "bare" is the cost of sendmmsg alone for the same datagrams.
#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/pattern_camera.hpp"
#include "tests/support/private_network.hpp"
#include "transports/gige/gige.hpp"

#include <arpa/inet.h>
#include <nlohmann/json.hpp>
#include <sched.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

using namespace obscura;
using namespace obscura::test;
using nlohmann::json;

namespace {

constexpr std::int32_t side = 1024;
double seconds = 2;
bool realtime = false;

void pin(unsigned core) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(core, &set);
    sched_setaffinity(0, sizeof set, &set);
}

/// A device in a child process, alive until destroyed.
class Device {
public:
    explicit Device(const std::function<void()>& run) {
        int ready[2];
        if (pipe(ready) != 0) throw std::runtime_error("pipe");
        pid_ = fork();
        if (pid_ == 0) {
            pin(0);
            run();
            const char byte = 1;
            if (write(ready[1], &byte, 1) != 1) _exit(1);
            for (;;)
                pause();
        }
        char byte = 0;
        if (read(ready[0], &byte, 1) != 1) throw std::runtime_error("device did not start");
        close(ready[0]);
        close(ready[1]);
    }
    ~Device() {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
    }
    /// CPU time used so far, ns, all threads.
    [[nodiscard]] double cpu_ns() const {
        double total = 0;
        std::ifstream stat("/proc/" + std::to_string(pid_) + "/stat");
        std::string line;
        std::getline(stat, line);
        std::istringstream fields(line.substr(line.rfind(')') + 2));
        std::string skip;
        for (int i = 0; i < 11; ++i)
            fields >> skip;
        long user = 0, system = 0;
        fields >> user >> system;
        total = static_cast<double>(user + system) / static_cast<double>(sysconf(_SC_CLK_TCK)) * 1e9;
        return total;
    }

private:
    pid_t pid_ = 0;
};

void run_ours(const std::string& address, const std::string& backend) {
    CameraLimits limits;
    limits.sensor_width = limits.sensor_height = side;
    limits.frame_rate_max_hz = 10'000;
    static MonotonicClock clock;
    if (realtime) make_this_thread_realtime(60);  // the frame generator's thread inherits
    auto* source = new PatternCamera(limits, 24); // for as long as the process lives
    source->set_blank(true);
    transports::gige::GigeSettings settings;
    settings.interface = address;
    settings.backend = enum_named<transports::gige::SendBackend>(backend).value();
    settings.throughput_limit_mbit_s = 0;
    auto* camera = new transports::gige::GigeCamera(
        settings, *source, clock, transports::gige::GigeContext{.thread = {realtime ? 60 : 0}});
    source->set_transport(*camera);
    camera->start();
}

void fill_nothing(ArvBuffer*, void*, guint32, guint32, ArvPixelFormat) {}

void run_peer(const std::string& address) {
    if (realtime) make_this_thread_realtime(60); // its thread inherits
    auto* fake = arv_gv_fake_camera_new(address.c_str(), "PEER");
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(fake), fill_nothing, nullptr);
    arv_fake_camera_set_trigger_frequency(arv_gv_fake_camera_get_fake_camera(fake), 1000);
}

struct FrameSeen {
    std::uint64_t id = 0;
    double leader_ns = 0, last_ns = 0;
    std::uint32_t packets = 0;
    bool trailer = false;
};

/// A bare GVSP receiver.
class Receiver {
public:
    Receiver() {
        fd_ = socket(AF_INET, SOCK_DGRAM, 0);
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_addr.s_addr = inet_addr("127.0.0.1");
        socklen_t bytes = sizeof a;
        const int buffer = 64 << 20, on = 1;
        setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer);
        setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
        if (bind(fd_, reinterpret_cast<sockaddr*>(&a), sizeof a) != 0 ||
            getsockname(fd_, reinterpret_cast<sockaddr*>(&a), &bytes) != 0)
            throw std::runtime_error("receiver socket");
        port_ = ntohs(a.sin_port);
        for (std::size_t i = 0; i < count; ++i) {
            pieces_[i] = {headers_[i].data(), headers_[i].size()};
            messages_[i].msg_hdr.msg_iov = &pieces_[i];
            messages_[i].msg_hdr.msg_iovlen = 1;
        }
    }
    ~Receiver() { close(fd_); }
    [[nodiscard]] std::uint16_t port() const { return port_; }

    /// Receives until `done` says so or nothing comes for `silence_ms`.
    std::vector<FrameSeen> receive(const std::function<bool(const std::vector<FrameSeen>&)>& done,
                                   int silence_ms) {
        timeval t{silence_ms / 1000, silence_ms % 1000 * 1000};
        setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &t, sizeof t);
        std::vector<FrameSeen> frames;
        frames.reserve(20'000);
        while (!done(frames)) {
            for (std::size_t i = 0; i < count; ++i) {
                messages_[i].msg_hdr.msg_control = control_[i].data();
                messages_[i].msg_hdr.msg_controllen = control_[i].size();
            }
            // The rest of each datagram is cut off: what is not read is not copied.
            const int n = recvmmsg(fd_, messages_.data(), count, MSG_WAITFORONE, nullptr);
            if (n <= 0) break;
            for (int i = 0; i < n; ++i)
                take(static_cast<std::size_t>(i), frames);
        }
        return frames;
    }

private:
    void take(std::size_t i, std::vector<FrameSeen>& frames) {
        const std::uint8_t* h = headers_[i].data();
        double t = 0;
        for (cmsghdr* c = CMSG_FIRSTHDR(&messages_[i].msg_hdr); c != nullptr;
             c = CMSG_NXTHDR(&messages_[i].msg_hdr, c))
            if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_TIMESTAMPNS) {
                timespec ts{};
                std::memcpy(&ts, CMSG_DATA(c), sizeof ts);
                t = static_cast<double>(ts.tv_sec) * 1e9 + static_cast<double>(ts.tv_nsec);
            }
        const std::uint64_t id = static_cast<std::uint64_t>(h[2] << 8 | h[3]);
        if (h[4] == 1) frames.push_back({id, t, t, 1, false});
        if (frames.empty() || frames.back().id != id) return;
        FrameSeen& f = frames.back();
        f.last_ns = t;
        if (h[4] == 3) ++f.packets;
        if (h[4] == 2) {
            ++f.packets;
            f.trailer = true;
        }
    }
    static constexpr std::size_t count = 64;
    int fd_ = -1;
    std::uint16_t port_ = 0;
    std::array<std::array<std::uint8_t, 64>, count> headers_{};
    std::array<std::array<std::uint8_t, 64>, count> control_{};
    std::array<iovec, count> pieces_{};
    std::array<mmsghdr, count> messages_{};
};

double quantile(std::vector<double> v, double q) {
    if (v.empty()) return 0;
    std::sort(v.begin(), v.end());
    return v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))];
}

bool complete(const FrameSeen& f, std::uint32_t packet_size) {
    const std::uint32_t payload = packet_size - 36;
    return f.trailer && f.packets == 2 + (2U * side * side + payload - 1) / payload;
}

/// Sets a stream of `rate_hz` up (0: as fast as can be; below 0: software trigger).
struct Session {
    GigeClient client;
    Receiver receiver;
    Session(const std::string& address, double rate_hz, std::uint32_t packet_size) : client(address) {
        client.set("PixelFormat", "Mono16");
        client.set("Width", std::int64_t{side});
        client.set("Height", std::int64_t{side});
        client.set("AcquisitionMode", "Continuous");
        GError* error = nullptr;
        arv_camera_clear_triggers(client.camera(), &error);
        g_clear_error(&error);
        if (rate_hz >= 0) {
            const double wanted = rate_hz > 0 ? rate_hz : 5000;
            arv_camera_set_frame_rate(client.camera(), wanted, &error); // clamped to what the device can
            g_clear_error(&error);
        } else {
            arv_camera_set_trigger(client.camera(), "Software", &error);
            check(error, "trigger");
        }
        arv_device_write_register(client.device(), 0xD04, packet_size, &error);
        arv_device_write_register(client.device(), 0xD18, 0x7F000001, &error);
        arv_device_write_register(client.device(), 0xD00, receiver.port(), &error);
        check(error, "stream registers");
    }
};

json throughput(const std::string& address, std::uint32_t packet_size) {
    Session s(address, 0, packet_size);
    s.client.execute("AcquisitionStart");
    const double end = seconds * 1e9;
    const auto frames = s.receiver.receive(
        [&](const std::vector<FrameSeen>& f) {
            return f.size() > 1 && f.back().leader_ns - f.front().leader_ns > end;
        },
        2000);
    s.client.execute("AcquisitionStop");
    std::vector<double> bursts;
    for (const FrameSeen& f : frames)
        if (complete(f, packet_size)) bursts.push_back((f.last_ns - f.leader_ns) / 1e6);
    const double span = frames.size() > 1 ? frames.back().leader_ns - frames.front().leader_ns : 1;
    return {{"frames_per_s", static_cast<double>(bursts.size()) / span * 1e9},
            {"complete", bursts.size()},
            {"begun", frames.size()},
            {"burst_ms_p50", quantile(bursts, 0.5)}};
}

json at_rate(const Device& device, const std::string& address, double rate_hz, std::uint32_t packet_size) {
    Session s(address, rate_hz, packet_size);
    const auto wanted = static_cast<std::size_t>(std::max(20.0, seconds * rate_hz * 1.5));
    s.client.execute("AcquisitionStart");
    s.receiver.receive([](const std::vector<FrameSeen>& f) { return f.size() > 5; }, 2000); // cold pages
    const double cpu = device.cpu_ns();
    const auto frames =
        s.receiver.receive([&](const std::vector<FrameSeen>& f) { return f.size() > wanted; }, 2000);
    const double used = device.cpu_ns() - cpu;
    s.client.execute("AcquisitionStop");
    std::vector<double> steps;
    std::size_t good = 0;
    double sum = 0;
    for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
        good += complete(frames[i], packet_size);
        if (i > 0) steps.push_back((frames[i].leader_ns - frames[i - 1].leader_ns) / 1e3);
    }
    for (const double d : steps)
        sum += (d - 1e6 / rate_hz) * (d - 1e6 / rate_hz);
    const double span = frames.size() > 1 ? frames.back().leader_ns - frames.front().leader_ns : 1;
    return {{"rate_hz", rate_hz},
            {"frames_per_s", static_cast<double>(frames.size() - 1) / span * 1e9},
            {"incomplete", frames.size() - 1 - good},
            {"jitter_us_rms", std::sqrt(sum / static_cast<double>(std::max<std::size_t>(steps.size(), 1)))},
            {"step_us_p1", quantile(steps, 0.01)},
            {"step_us_p99", quantile(steps, 0.99)},
            {"cpu_ms_per_frame", used / 1e6 / static_cast<double>(frames.size())}};
}

/// CPU time of a frame's datagrams alone at `rate_hz`: sendmmsg on a connected socket from memory that is
/// ready, in a process that does nothing else. No sender of single packets through the kernel's UDP can cost
/// less.
json bare_at_rate(double rate_hz, std::uint32_t packet_size) {
    Receiver receiver;
    const std::uint32_t payload = packet_size - 36, packets = 2 + (2U * side * side + payload - 1) / payload;
    const Device device([&] {
        std::thread([=, port = receiver.port()] {
            if (realtime) make_this_thread_realtime(60);
            constexpr std::size_t batch = 64; // as PacketSocket
            const int fd = socket(AF_INET, SOCK_DGRAM, 0);
            sockaddr_in to{};
            to.sin_family = AF_INET;
            to.sin_addr.s_addr = inet_addr("127.0.0.1");
            to.sin_port = htons(port);
            if (connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) _exit(1);
            std::vector<std::uint8_t> image(std::size_t{packets} * payload);
            std::array<std::array<std::uint8_t, 8>, batch> headers{};
            std::array<std::array<iovec, 2>, batch> pieces{};
            std::array<mmsghdr, batch> messages{};
            MonotonicClock clock;
            Time due = clock.now();
            for (std::uint16_t frame = 1;; ++frame) {
                for (std::uint32_t id = 0; id < packets;) {
                    std::size_t n = 0;
                    for (; n < batch && id < packets; ++n, ++id) {
                        const std::uint8_t kind = id == 0 ? 1 : id + 1 == packets ? 2 : 3;
                        headers[n] = {
                            0,    0, static_cast<std::uint8_t>(frame >> 8), static_cast<std::uint8_t>(frame),
                            kind, 0, static_cast<std::uint8_t>(id >> 8),    static_cast<std::uint8_t>(id)};
                        pieces[n] = {
                            iovec{headers[n].data(), 8},
                            iovec{image.data() + std::size_t{id} * payload, kind == 3 ? payload : 36}};
                        messages[n].msg_hdr.msg_iov = pieces[n].data();
                        messages[n].msg_hdr.msg_iovlen = 2;
                    }
                    for (std::size_t sent = 0; sent < n;) {
                        const int k = sendmmsg(fd, &messages[sent], static_cast<unsigned>(n - sent), 0);
                        if (k <= 0) _exit(1);
                        sent += static_cast<std::size_t>(k);
                    }
                }
                due = due + static_cast<std::int64_t>(1e9 / rate_hz);
                clock.sleep_until(due);
            }
        }).detach();
    });
    receiver.receive([](const std::vector<FrameSeen>& f) { return f.size() > 5; }, 2000); // cold pages
    const double cpu = device.cpu_ns();
    const auto wanted = static_cast<std::size_t>(std::max(20.0, seconds * rate_hz * 1.5));
    const auto frames =
        receiver.receive([&](const std::vector<FrameSeen>& f) { return f.size() > wanted; }, 2000);
    return {{"rate_hz", rate_hz},
            {"complete", std::count_if(frames.begin(), frames.end(),
                                       [&](const FrameSeen& f) { return complete(f, packet_size); })},
            {"cpu_ms_per_frame", (device.cpu_ns() - cpu) / 1e6 / static_cast<double>(frames.size())}};
}

json trigger(const std::string& address, std::uint32_t packet_size) {
    Session s(address, -1, packet_size);
    s.client.execute("AcquisitionStart");
    std::vector<double> first, last;
    for (int i = 0; i < 60; ++i) {
        timespec now{};
        clock_gettime(CLOCK_REALTIME, &now);
        const double t0 = static_cast<double>(now.tv_sec) * 1e9 + static_cast<double>(now.tv_nsec);
        s.client.execute("TriggerSoftware");
        const auto frames = s.receiver.receive(
            [](const std::vector<FrameSeen>& f) { return !f.empty() && f.back().trailer; }, 500);
        if (frames.empty() || i < 10) continue; // cold pages
        first.push_back((frames[0].leader_ns - t0) / 1e6);
        last.push_back((frames[0].last_ns - t0) / 1e6);
    }
    s.client.execute("AcquisitionStop");
    return {{"triggers", first.size()},
            {"first_ms_p50", quantile(first, 0.5)},
            {"first_ms_p99", quantile(first, 0.99)},
            {"last_ms_p50", quantile(last, 0.5)},
            {"last_ms_p99", quantile(last, 0.99)}};
}

json all(const std::string& address, const std::function<void()>& run) {
    const Device device(run);
    json out;
    out["1500"] = throughput(address, 1500);
    out["9000"] = throughput(address, 9000);
    out["30hz"] = at_rate(device, address, 30, 1500);
    out["100hz"] = at_rate(device, address, 100, 1500);
    out["trigger"] = trigger(address, 1500);
    return out;
}

double number(const json& j, const char* a, const char* b) {
    return j.at(a).at(b).get<double>();
}

} // namespace

int main(int argc, char* argv[]) {
    for (int i = 1; i < argc; ++i) {
        if (std::strcmp(argv[i], "--realtime") == 0) realtime = true;
        if (std::strcmp(argv[i], "--seconds") == 0 && i + 1 < argc) seconds = std::atof(argv[++i]);
    }
    try {
        enter_private_network();
        pin(static_cast<unsigned>(std::max(sysconf(_SC_NPROCESSORS_ONLN), 1L)) - 1);
        if (realtime) make_this_thread_realtime(50); // the receiver has no competitor either
        json out;
        out["realtime"] = realtime && realtime_permitted(60).granted;
        // The simulator only lives on an interface, not on one of its further addresses.
        out["peer"] = all("127.0.0.1", [] { run_peer("lo"); });
        out["sendmmsg"] = all("127.0.0.11", [] { run_ours("127.0.0.11", "sendmmsg"); });
        out["gso"] = all("127.0.0.12", [] { run_ours("127.0.0.12", "gso"); });
        out["bare"]["30hz"] = bare_at_rate(30, 1500);
        const json& peer = out["peer"];
        out["ratios"]["bare"]["cpu_30hz"] =
            number(out["bare"], "30hz", "cpu_ms_per_frame") / number(peer, "30hz", "cpu_ms_per_frame");
        for (const char* backend : {"sendmmsg", "gso"})
            out["ratios"][backend] = {{"frames_1500", number(out[backend], "1500", "frames_per_s") /
                                                          number(peer, "1500", "frames_per_s")},
                                      {"frames_9000", number(out[backend], "9000", "frames_per_s") /
                                                          number(peer, "9000", "frames_per_s")},
                                      {"cpu_30hz", number(out[backend], "30hz", "cpu_ms_per_frame") /
                                                       number(peer, "30hz", "cpu_ms_per_frame")},
                                      {"jitter_100hz", number(out[backend], "100hz", "jitter_us_rms") /
                                                           number(peer, "100hz", "jitter_us_rms")}};
        std::cout << out.dump(2) << "\n";
    } catch (const std::exception& e) {
        std::fprintf(stderr, "gige_bench: %s\n", e.what());
        return 1;
    }
    return 0;
}
