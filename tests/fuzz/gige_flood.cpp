// SPDX-License-Identifier: Apache-2.0
// Hostile datagrams at a camera that streams to a client meanwhile: not one frame may be lost.
//
// Usage: gige_flood [DATAGRAMS [SEED]]. A million is the long run, with -fsanitize=address,undefined (preset
// asan). The datagrams are random bytes and commands of every kind, whole and damaged, from four addresses,
// the client's among them; those that would do no harm if they were meant also from the client's own control
// socket. Exit status 1 when a frame was lost or damaged, or control was.
#include "core/clock.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/gige.hpp"
#include "transports/gige/wire/bytes.hpp"
#include "transports/gige/wire/gvcp.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace obscura;
using namespace obscura::test;
using namespace obscura::transports::gige;

namespace {

using Random = std::mt19937;
using Datagram = std::vector<std::uint8_t>;

void append(Datagram& d, std::uint64_t value, int bytes) {
    for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
        d.push_back(static_cast<std::uint8_t>(value >> shift));
}

Datagram header(std::uint8_t flags, Command command, std::uint16_t id) {
    Datagram d{gvcp_key, flags};
    append(d, static_cast<std::uint16_t>(command), 2);
    append(d, 0, 2); // length, see finish()
    append(d, id, 2);
    return d;
}

void finish(Datagram& d) {
    store_be16(d.data() + 4, static_cast<std::uint16_t>(d.size() - gvcp_header_bytes));
}

/// One of the places where something happens, or any.
std::uint32_t some_address(Random& random) {
    static constexpr std::array<std::uint32_t, 28> places{
        0,      0x200,  0x934,  0x938,  0x944,  0x954,  0xA00,    0xA04,     0xB00,  0xB10,
        0xD00,  0xD04,  0xD18,  0xD24,  0x9800, 0xA020, 0xA104,   0xA108,    0xAA08, 0xA200,
        0xA300, 0xA400, 0xA450, 0xA500, 0xA800, 0xB000, 0x100000, 0xFFFFFFFC};
    return random() % 8 == 0 ? static_cast<std::uint32_t>(random()) : places[random() % places.size()];
}

std::uint32_t some_value(Random& random) {
    return static_cast<std::uint32_t>(random() >> random() % 32);
}

/// PACKETRESEND about blocks that are being sent, kept, gone and still to come.
Datagram resend_request(Random& random, std::uint64_t newest_block) {
    const bool extended = random() % 2 == 0;
    Datagram d = header(extended ? gvcp_flag::extended_ids : 0, Command::packet_resend,
                        static_cast<std::uint16_t>(random()));
    const std::uint64_t block = random() % 4 == 0 ? random() : newest_block + 4 - random() % 40;
    const std::uint32_t first = random() % 4 == 0 ? some_value(random) : random() % 24;
    append(d, random() % 16 == 0 ? random() & 0xFFFF : 0, 2); // channel
    append(d, extended ? 0 : block & 0xFFFF, 2);
    append(d, first, 4);
    append(d, random() % 2 == 0 ? 0xFFFFFFFF : first + random() % 24, 4);
    if (extended) append(d, block, 8);
    return d;
}

/// A sound command of any kind; `harmless`: one that changes nothing even when it comes from the controller.
Datagram command(Random& random, std::uint64_t newest_block, bool harmless) {
    const std::uint8_t flags = random() % 4 == 0 ? static_cast<std::uint8_t>(random()) : 1;
    const auto id = static_cast<std::uint16_t>(random());
    Datagram d;
    switch (random() % (harmless ? 4 : 11)) {
    case 0:
        d = header(flags, Command::discovery, id);
        break;
    case 4:
    case 9:
    case 10:
        d = resend_request(random, newest_block);
        break;
    case 2:
        d = header(flags, Command::read_register, id);
        for (auto n = 1 + random() % (random() % 8 == 0 ? 140 : 4); n > 0; --n)
            append(d, some_address(random), 4);
        break;
    case 3:
        d = header(flags, Command::read_memory, id);
        append(d, some_address(random), 4);
        append(d, random() % 8 == 0 ? some_value(random) : random() % 135 * 4, 4);
        break;
    case 1:
        d = header(flags, static_cast<Command>(0x0200 + random() % 64), id);
        append(d, random(), 4);
        break;
    case 5:
        d = header(flags, Command::write_register, id);
        for (auto n = 1 + random() % (random() % 8 == 0 ? 70 : 4); n > 0; --n) {
            append(d, some_address(random), 4);
            append(d, some_value(random), 4);
        }
        break;
    case 6:
        d = header(flags, Command::write_memory, id);
        append(d, some_address(random), 4);
        for (auto n = 1 + random() % (random() % 8 == 0 ? 134 : 4); n > 0; --n)
            append(d, some_value(random), 4);
        break;
    case 7:
        d = header(flags, Command::force_ip, id);
        for (int i = 0; i < 14; ++i)
            append(d, some_value(random), 4);
        break;
    default:
        d = header(flags, Command::action, id);
        for (int i = 0; i < ((flags & gvcp_flag::scheduled) != 0 ? 5 : 3); ++i)
            append(d, random() % 2 == 0 ? 0 : some_value(random), 4);
        break;
    }
    finish(d);
    return d;
}

void damage(Random& random, Datagram& d) {
    switch (random() % 4) {
    case 0:
        d.resize(random() % (d.size() + 1));
        break;
    case 1:
    case 9:
    case 10:
        d.resize(d.size() + random() % 1500);
        break;
    default:
        for (auto n = 1 + random() % 4; n > 0; --n)
            d[random() % d.size()] = static_cast<std::uint8_t>(random());
        break;
    }
}

Datagram hostile(Random& random, std::uint64_t newest_block) {
    if (random() % 8 == 0) {
        Datagram d(random() % 2100);
        for (std::uint8_t& byte : d)
            byte = static_cast<std::uint8_t>(random());
        if (d.size() > 1 && random() % 2 == 0) d[0] = gvcp_key;
        return d;
    }
    Datagram d = command(random, newest_block, false);
    if (random() % 2 == 0) damage(random, d);
    return d;
}

/// The client's control socket: a file descriptor of this process.
int control_socket(const GigeClient& client) {
    guint32 port = 0;
    GError* error = nullptr;
    arv_device_read_register(client.device(), reg::primary_port, &port, &error);
    check(error, "controller's port");
    for (int fd = 3; fd < 256; ++fd) {
        sockaddr_in own{};
        socklen_t bytes = sizeof own;
        int type = 0;
        socklen_t type_bytes = sizeof type;
        if (getsockname(fd, reinterpret_cast<sockaddr*>(&own), &bytes) == 0 && own.sin_family == AF_INET &&
            ntohs(own.sin_port) == port && getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_bytes) == 0 &&
            type == SOCK_DGRAM)
            return fd;
    }
    throw std::runtime_error("the client has no control socket");
}

int sender(std::uint32_t ip) {
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(ip);
    if (fd < 0 || bind(fd, reinterpret_cast<sockaddr*>(&own), sizeof own) != 0)
        throw std::runtime_error("no socket to send from");
    return fd;
}

int flood(long datagrams, unsigned seed) {
    const std::string address = own_loopback_address();
    CameraLimits limits;
    limits.sensor_width = 128;
    limits.sensor_height = 96;
    MonotonicClock clock;
    PatternCamera source(limits, 110);
    GigeSettings settings;
    settings.interface = address;
    settings.history_frames = 90;
    GigeCamera camera(settings, source, clock);
    source.set_transport(camera);
    camera.start();

    std::atomic<std::uint64_t> newest{0}; // block id
    std::uint64_t frames = 0, bad = 0;
    bool controlled = false;
    {
        GigeClient client(address);
        client.set("AcquisitionFrameRate", 20.0);
        client.set("TriggerMode", "Off");
        client.open_stream(300);
        // The machine may be busy with other things for seconds.
        g_object_set(client.stream(), "frame-retention", 10'000'000U, nullptr);
        client.execute("AcquisitionStart");
        const int own = control_socket(client);
        std::atomic<bool> done{false};
        std::thread attacker([&] {
            Random random(seed);
            std::array<int, 4> senders{};
            for (std::uint32_t i = 0; i < senders.size(); ++i)
                senders[i] = sender(INADDR_LOOPBACK + i); // the first is the client's address
            sockaddr_in to{};
            to.sin_family = AF_INET;
            to.sin_port = htons(gvcp_port);
            inet_pton(AF_INET, address.c_str(), &to.sin_addr);
            constexpr long burst = 32;
            std::uint64_t before = camera.gige_counters().commands;
            for (long i = 1; i <= datagrams; ++i) {
                const bool as_client = random() % 16 == 0;
                Datagram d = as_client ? command(random, newest, true) : hostile(random, newest);
                // Cut or lengthened, no harmless command becomes another.
                if (as_client && random() % 2 == 0) d.resize(random() % (2 * d.size()));
                const int from = as_client ? own : senders[random() % senders.size()];
                sendto(from, d.data(), d.size(), MSG_NOSIGNAL, reinterpret_cast<sockaddr*>(&to), sizeof to);
                // As fast as it takes them, few at a time: what the socket buffer drops has tested nothing.
                // Datagrams too long for the camera to look at are not counted.
                if (i % burst != 0) continue;
                const Time give_up = clock.now() + 2 * ns_per_ms;
                while (camera.gige_counters().commands < before + burst && clock.now() < give_up)
                    std::this_thread::yield();
                before = camera.gige_counters().commands;
            }
            for (const int s : senders)
                close(s);
            done = true;
        });
        // Until the flood has ended, and some frames longer: it may have left something behind.
        for (int after = 0; after < 10; after += done ? 1 : 0) {
            auto buffer = client.next(10'000);
            if (buffer == nullptr) {
                ++bad;
                break;
            }
            // Ids that were passed over are frames lost.
            const std::uint64_t id = arv_buffer_get_frame_id(buffer.get());
            const bool whole = arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS;
            if (!whole || id != newest + 1)
                std::fprintf(stderr, "frame %llu after %llu: status %d\n",
                             static_cast<unsigned long long>(id),
                             static_cast<unsigned long long>(newest.load()),
                             static_cast<int>(arv_buffer_get_status(buffer.get())));
            bad += (whole ? 0 : 1) + (id > newest ? id - newest - 1 : 1);
            newest = std::max<std::uint64_t>(newest, id);
            ++frames;
            client.give_back(std::move(buffer));
        }
        attacker.join();
        guint32 privilege_left = 0;
        GError* error = nullptr;
        arv_device_read_register(client.device(), reg::control_privilege, &privilege_left, &error);
        check(error, "control privilege");
        controlled = privilege_left == privilege::control;
        client.execute("AcquisitionStop");
    }
    const GigeCounters c = camera.gige_counters();
    source.acquisition_stop(true);
    camera.stop();
    std::printf("{\"datagrams\": %ld, \"handled\": %llu, \"denied\": %llu, \"throttled\": %llu, "
                "\"resend_requests\": %llu, \"frames\": %llu, \"bad\": %llu}\n",
                datagrams, static_cast<unsigned long long>(c.commands),
                static_cast<unsigned long long>(c.denied), static_cast<unsigned long long>(c.throttled),
                static_cast<unsigned long long>(c.resend_requests), static_cast<unsigned long long>(frames),
                static_cast<unsigned long long>(bad));
    return bad == 0 && controlled && c.control_lost == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char* argv[]) {
    try {
        return flood(argc > 1 ? std::atol(argv[1]) : 1'000'000,
                     argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
