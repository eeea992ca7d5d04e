// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: hostile resend requests at a stream with blocks in its store, one of them in work.
//
// Input: a byte of options (bit 0: 64-bit ids, bit 1: chunks, bit 2: multi-part), then requests, each a byte
// of GVCP flags (bit 1: not from the receiver) and, as they say, 12 or 20 bytes of PACKETRESEND. What comes
// out of the socket must be what was sent before or an error, and no more than each block's allowance.
#include "core/clock.hpp"
#include "tests/support/loopback_interface.hpp"
#include "tests/support/plain_frame.hpp"
#include "transports/gige/channels/gvsp_sender.hpp"
#include "transports/gige/wire/bytes.hpp"
#include "transports/gige/wire/gvcp_parser.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <span>
#include <utility>
#include <vector>

using namespace obscura;
using namespace obscura::transports::gige;

namespace {

void require(bool truth) {
    if (!truth) std::abort();
}

constexpr std::int32_t width = 64, height = 24;
constexpr std::uint32_t packet_size = 576;
constexpr std::uint64_t blocks_sent = 7; // of which the history keeps four and the one in work
constexpr std::uint32_t allowance = 4;   // times that a block may be sent again
constexpr std::uint32_t allowance_of_others = 1;

/// Where the packets arrive.
class Receiver {
public:
    Receiver() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        require(fd_ >= 0 && bind(fd_, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
        const int room = 8 << 20;
        setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
        setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
        socklen_t bytes = sizeof a;
        getsockname(fd_, reinterpret_cast<sockaddr*>(&a), &bytes);
        port_ = ntohs(a.sin_port);
    }
    ~Receiver() { close(fd_); }
    Receiver(const Receiver&) = delete;
    Receiver& operator=(const Receiver&) = delete;

    [[nodiscard]] std::uint16_t port() const { return port_; }
    /// The next datagram, empty when there is none.
    std::span<const std::uint8_t> next() {
        const ssize_t n = recv(fd_, buffer_.data(), buffer_.size(), MSG_TRUNC);
        require(n <= static_cast<ssize_t>(packet_size - ip_udp_bytes));
        return {buffer_.data(), n < 0 ? 0 : static_cast<std::size_t>(n)};
    }

private:
    int fd_;
    std::uint16_t port_ = 0;
    std::array<std::uint8_t, 2048> buffer_{};
};

struct Packet {
    std::uint16_t status = 0;
    std::uint64_t block = 0;
    std::uint32_t id = 0;
    std::vector<std::uint8_t> rest; // but for status and the mark of a resent packet all of it
};

Packet parse(std::span<const std::uint8_t> d, bool extended) {
    const std::size_t header = extended ? gvsp_extended_header_bytes : gvsp_header_bytes;
    require(d.size() >= header);
    Packet p;
    p.status = load_be16(d.data());
    p.block = extended ? load_be64(d.data() + 8) : load_be16(d.data() + 2);
    p.id = extended ? load_be32(d.data() + 16) : load_be32(d.data() + 4) & 0xFFFFFF;
    p.rest.assign(d.begin() + 4, d.end());
    return p;
}

/// A sender that lives as long as the program, and what it needs.
struct Bench {
    const NetworkInterface network = test::loopback_interface();
    GigeSettings settings;
    MonotonicClock clock;
    MessageChannel messages{network};
    FramePool pool{16, width* height, height};
    Receiver receiver;
    GvspSender sender{settings, network, messages, clock};

    Bench() { sender.start(); }
    ~Bench() { sender.stop(); }
    Bench(const Bench&) = delete;
    Bench& operator=(const Bench&) = delete;

    FrameRef submit(std::uint64_t id, std::int32_t rows) {
        FrameRef frame = pool.acquire();
        require(bool{frame});
        test::describe_mono16(frame->info, id, width, height);
        std::uint16_t value = static_cast<std::uint16_t>(id * 257);
        for (std::int32_t y = 0; y < height; ++y)
            for (std::uint16_t& pixel : frame->row(y))
                pixel = value++;
        require(sender.submit(frame));
        frame->publish_rows(rows);
        return frame;
    }
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Bench bench;
    if (size < 1) return 0;
    StreamConfig config;
    config.destination_ip = INADDR_LOOPBACK;
    config.destination_port = bench.receiver.port();
    config.packet_size = packet_size;
    config.payload.multipart = (data[0] & 4) != 0;
    config.extended_ids = (data[0] & 1) != 0 || config.payload.multipart;
    config.payload.chunks =
        (data[0] & 2) != 0 ? chunk_bit(Chunk::timestamp) | chunk_bit(Chunk::row_times) : 0;
    config.payload.max_width = width;
    config.payload.max_height = height;
    config.payload.max_image_bytes = std::size_t{2} * width * height;
    require(bench.sender.begin(config));
    for (std::uint64_t id = 1; id < blocks_sent; ++id) {
        bench.submit(id, height);
        require(bench.sender.wait_idle(5 * ns_per_s));
    }
    bool errors_expected = false;
    const FrameRef in_work = bench.submit(blocks_sent, height / 2);

    for (std::size_t at = 1; at < size;) {
        const std::uint8_t flags = data[at++];
        const std::size_t n =
            std::min<std::size_t>((flags & gvcp_flag::extended_ids) != 0 ? 20 : 12, size - at);
        std::array<std::uint8_t, gvcp_header_bytes + 20> datagram{
            gvcp_key, flags, 0, 0x40, 0, static_cast<std::uint8_t>(n), 0, 1};
        std::copy_n(data + at, n, datagram.begin() + gvcp_header_bytes);
        at += n;
        const Request request = parse_gvcp({datagram.data(), gvcp_header_bytes + n}, false);
        if (request.kind != Request::Kind::run) continue;
        ResendRequest wanted = request.resend;
        wanted.trusted = (flags & 2) == 0;
        errors_expected = errors_expected || wanted.trusted;
        bench.sender.resend(wanted);
    }
    // The requests are in the queue before the rows are there, and come first.
    in_work->publish_rows(height);
    require(bench.sender.wait_idle(5 * ns_per_s));

    std::map<std::pair<std::uint64_t, std::uint32_t>, Packet> sent;
    std::map<std::uint64_t, std::uint32_t> resent, packets;
    for (auto datagram = bench.receiver.next(); !datagram.empty(); datagram = bench.receiver.next()) {
        Packet p = parse(datagram, config.extended_ids);
        if ((p.status & 0x8000) != 0) {
            // Never about a block that has not been, and never because others asked.
            require(errors_expected && p.block >= 1 && p.block <= blocks_sent);
            continue;
        }
        require(p.block >= 1 && p.block <= blocks_sent);
        const auto key = std::pair{p.block, p.id};
        if (const auto before = sent.find(key); before != sent.end()) {
            require(before->second.rest == p.rest);
            ++resent[p.block];
        } else {
            require(p.status == 0);
            ++packets[p.block];
            sent.emplace(key, std::move(p));
        }
    }
    require(packets.size() == blocks_sent);
    for (const auto& [block, n] : resent)
        require(n <= (allowance + allowance_of_others) * packets[block]);
    return 0;
}
