#include "transports/gige/gvsp_sender.hpp"

#include "core/philox.hpp"
#include "core/realtime.hpp"

#include <algorithm>
#include <cassert>

namespace obscura::transports::gige {
namespace {

// Ethernet header, frame check, preamble and gap around each IP datagram.
constexpr std::int64_t ethernet_overhead_bytes = 38;
// Batches of paced packets span about this long: short enough to look even, long enough to be worth a sleep.
constexpr std::int64_t paced_batch_ns = 100 * ns_per_us;
// How often a block may be sent again in total, so that forged requests cannot turn the camera into a
// cannon.
constexpr std::uint32_t resend_budget = 4;

int stored_bits(PixelFormat format) noexcept {
    switch (format) {
    case PixelFormat::mono10:
        return 10;
    case PixelFormat::mono12:
        return 12;
    case PixelFormat::mono14:
        return 14;
    case PixelFormat::mono16:
        return 16;
    default:
        return 0; // not held in 16-bit words
    }
}

} // namespace

GvspSender::GvspSender(const GigeSettings& settings, const NetworkInterface& network, const Clock& clock)
    : settings_(settings),
      network_(network),
      clock_(clock),
      loss_threshold_(
          static_cast<std::uint64_t>(std::clamp(settings.drop_percent, 0.0, 100.0) / 100 * 0x1p32)) {}

void GvspSender::start() {
    socket_.open(network_, 4U << 20);
    socket_.set_backend(settings_.backend == "sendto" ? SendBackend::sendto : SendBackend::sendmmsg);
    quit_.store(false);
    thread_ = std::thread([this] { loop(); });
}

void GvspSender::stop() {
    if (!thread_.joinable()) return;
    accepting_.store(false);
    quit_.store(true);
    wake_.ring();
    thread_.join();
    for (FrameRef left; queue_.pop(left);)
        counters_.dropped.fetch_add(1, std::memory_order_relaxed);
    session_ = nullptr;
    owned_session_.reset(); // gives the history's frames back to their pool
    socket_.close();
}

bool GvspSender::submit(const FrameRef& frame) noexcept {
    counters_.submitted.fetch_add(1, std::memory_order_relaxed);
    // The bell first: rows may be published as soon as the frame is in the queue.
    if (accepting_.load(std::memory_order_acquire) && frame->add_bell(wake_) && queue_.push(frame)) {
        wake_.ring();
        return true;
    }
    counters_.dropped.fetch_add(1, std::memory_order_relaxed);
    return false;
}

bool GvspSender::begin(const StreamConfig& config) {
    accepting_.store(false);
    if (!thread_.joinable()) return false;
    if (!wait_idle(ns_per_s)) {
        abort();
        if (!wait_idle(ns_per_s)) return false;
    }
    auto session = std::make_unique<Session>();
    session->config = config;
    session->packet_payload = config.packet_size - ip_udp_bytes -
                              (config.extended_ids ? gvsp_extended_header_bytes : gvsp_header_bytes);
    const std::int64_t wire_bytes = config.packet_size + ethernet_overhead_bytes;
    if (config.packet_delay_ns > 0)
        session->packet_interval_ns = config.packet_delay_ns + wire_bytes * 8000 / network_.speed_mbit_s;
    if (config.throughput_limit > 0)
        session->packet_interval_ns =
            std::max(session->packet_interval_ns, wire_bytes * ns_per_s / config.throughput_limit);
    if (session->packet_interval_ns > 0) {
        session->batch = static_cast<std::uint32_t>(
            std::clamp<std::int64_t>(paced_batch_ns / session->packet_interval_ns, 1, session->batch));
    }
    session->zeros.resize(session->packet_payload);
    session->blocks.resize(static_cast<std::size_t>(std::max(settings_.history_frames, 1)) + 1);
    if (config.packs_pixels)
        for (Block& b : session->blocks)
            b.packing = std::make_unique<std::uint8_t[]>(config.max_payload_bytes);

    if (config.continue_blocks && owned_session_) session->frames = owned_session_->frames;

    incoming_.store(session.get(), std::memory_order_release);
    for (const Time give_up = clock_.now() + ns_per_s;;) {
        const std::uint32_t seen = rest_.value();
        wake_.ring();
        if (incoming_.load(std::memory_order_acquire) == nullptr) break;
        if (clock_.now() >= give_up && incoming_.exchange(nullptr) != nullptr) return false;
        rest_.wait(seen, clock_.now() + 10 * ns_per_ms);
    }
    owned_session_ = std::move(session);
    abort_.store(false, std::memory_order_release);
    accepting_.store(true, std::memory_order_release);
    return true;
}

void GvspSender::abort() noexcept {
    accepting_.store(false, std::memory_order_release);
    abort_.store(true, std::memory_order_release);
    wake_.ring();
}

bool GvspSender::idle() const noexcept {
    // In this order: the sender says that it works before it takes from the queue.
    return queue_.empty() && !working_.load(std::memory_order_seq_cst);
}

bool GvspSender::wait_idle(std::int64_t span_ns) noexcept {
    for (const Time give_up = clock_.now() + span_ns;;) {
        const std::uint32_t seen = rest_.value();
        if (idle() || !thread_.joinable()) return true;
        if (clock_.now() >= give_up) return false;
        rest_.wait(seen, std::min(give_up, clock_.now() + 10 * ns_per_ms));
    }
}

void GvspSender::resend(const ResendRequest& request) noexcept {
    counters_.resend_requests.fetch_add(1, std::memory_order_relaxed);
    if (resends_.push(request)) {
        wake_.ring();
    } else {
        counters_.resend_refused.fetch_add(1, std::memory_order_relaxed);
    }
}

bool GvspSender::send_test_packet(const StreamConfig& config) noexcept {
    // On a socket of its own: the stream's belongs to the sender thread. Same address, any source port.
    try {
        PacketSocket once;
        once.open(network_, 1U << 20);
        once.set_destination(config.destination_ip, config.destination_port);
        once.set_do_not_fragment(config.do_not_fragment);
        std::array<std::uint8_t, gvsp_extended_header_bytes> header{};
        const std::size_t n = write_gvsp_header(header.data(), config.extended_ids, Status::success, 0,
                                                PacketFormat::payload, 0, false);
        const std::vector<std::uint8_t> body(config.packet_size - ip_udp_bytes - n);
        once.add({header.data(), n}, body);
        once.flush();
        return once.errors() == 0;
    } catch (const std::exception&) {
        return false;
    }
}

void GvspSender::loop() {
    name_this_thread("gige-stream");
    if (settings_.realtime_priority > 0) make_this_thread_realtime(settings_.realtime_priority);
    while (!quit_.load(std::memory_order_acquire)) {
        const std::uint32_t seen = wake_.value();
        install_session();
        serve_resends();
        working_.store(true, std::memory_order_seq_cst);
        FrameRef frame;
        const bool got = queue_.pop(frame);
        if (got) send_frame(std::move(frame));
        working_.store(false, std::memory_order_seq_cst);
        if (got) {
            rest_.ring();
        } else {
            wake_.wait(seen);
        }
    }
    working_.store(false);
    rest_.ring();
}

void GvspSender::install_session() noexcept {
    Session* next = incoming_.load(std::memory_order_acquire);
    if (next == nullptr) return;
    session_ = next;
    socket_.set_destination(next->config.destination_ip, next->config.destination_port);
    socket_.set_do_not_fragment(next->config.do_not_fragment);
    for (ResendRequest stale; resends_.pop(stale);) {
    }
    // Only now may the control thread free the session before.
    incoming_.store(nullptr, std::memory_order_release);
    rest_.ring();
}

void GvspSender::send_frame(FrameRef frame) noexcept {
    bool delivered = false;
    if (session_ != nullptr && !giving_up() && session_->config.destination_port != 0) {
        Block& block = session_->blocks[session_->frames % session_->blocks.size()];
        if (prepare(block, std::move(frame))) {
            const Time edge = block.frame->info.trigger_edge;
            ++session_->frames; // from here on in the history
            queue_packet(block, 0, false);
            socket_.flush();
            block.sent = 1;
            counters_.trigger_to_first.add(clock_.now() - edge);
            if (send_payload(block)) {
                block.trailer_bytes = write_image_trailer(block.trailer.data(), block.frame->info.height);
                queue_packet(block, block.sent, false);
                socket_.flush();
                ++block.sent;
                counters_.trigger_to_last.add(clock_.now() - edge);
                delivered = true;
            }
        }
    }
    (delivered ? counters_.delivered : counters_.dropped).fetch_add(1, std::memory_order_relaxed);
}

bool GvspSender::prepare(Block& block, FrameRef frame) noexcept {
    const FrameInfo& info = frame->info;
    const std::int64_t pixels = std::int64_t{info.width} * info.height;
    block.direct = stored_bits(info.pixel_format) >= info.bits_per_pixel;
    block.bytes = packed_bytes(info.pixel_format, pixels);
    if (pixels <= 0 || block.bytes > session_->config.max_payload_bytes) return false;
    if (!block.direct && block.packing == nullptr) return false;
    block.data =
        block.direct ? reinterpret_cast<const std::uint8_t*>(frame->pixels().data()) : block.packing.get();
    block.available = block.valid = block.packed_pixels = 0;
    block.sent = block.resent = 0;
    block.payload_packets =
        static_cast<std::uint32_t>((block.bytes + session_->packet_payload - 1) / session_->packet_payload);
    block.count = session_->frames + 1;
    block.wire_id = wire_block_id(block.count, session_->config.extended_ids);
    const auto stamp = static_cast<std::uint64_t>(info.trigger_edge.ns + info.tai_offset_ns -
                                                  session_->config.timestamp_origin_ns);
    block.leader_bytes = write_image_leader(block.leader.data(), info, stamp);
    block.trailer_bytes = 0;
    block.frame = std::move(frame);
    return true;
}

void GvspSender::make_available(Block& block) noexcept {
    if (block.available == block.bytes) return;
    const Frame& frame = *block.frame;
    // Before the rows: what was published before the producer gave up is then certainly seen.
    const bool abandoned = frame.abandoned();
    const auto width = static_cast<std::size_t>(frame.info.width);
    const std::size_t ready = static_cast<std::size_t>(frame.rows_ready()) * width;
    if (block.direct) {
        block.available = block.valid = 2 * ready;
    } else {
        // Eight pixels of any depth fill whole bytes, so that the next stretch starts at one.
        const std::size_t all = frame.pixels().size();
        const std::size_t until = ready == all || abandoned ? ready : ready / 8 * 8;
        if (until > block.packed_pixels) {
            const std::size_t from =
                packed_bytes(frame.info.pixel_format, static_cast<std::int64_t>(block.packed_pixels));
            pack_pixels(frame.info.pixel_format, frame.info.bits_per_pixel,
                        frame.pixels().subspan(block.packed_pixels, until - block.packed_pixels),
                        {block.packing.get() + from, block.bytes - from});
            block.packed_pixels = until;
        }
        block.available = block.valid =
            packed_bytes(frame.info.pixel_format, static_cast<std::int64_t>(block.packed_pixels));
    }
    if (abandoned) block.available = block.bytes;
}

bool GvspSender::send_payload(Block& block) noexcept {
    const std::uint32_t end = block.payload_packets + 1; // payload has the ids 1 .. end - 1
    Time due = clock_.now();
    while (block.sent < end) {
        const std::uint32_t seen = wake_.value();
        if (giving_up()) return false;
        serve_resends();
        make_available(block);
        const auto ready = static_cast<std::uint32_t>(block.available == block.bytes
                                                          ? block.payload_packets
                                                          : block.available / session_->packet_payload);
        const std::uint32_t until = std::min({block.sent + session_->batch, ready + 1, end});
        if (until <= block.sent) {
            wake_.wait(seen);
            continue;
        }
        pace(due, until - block.sent);
        for (std::uint32_t id = block.sent; id < until; ++id) {
            if (leave_out(block, id)) {
                counters_.injected_losses.fetch_add(1, std::memory_order_relaxed);
            } else {
                queue_packet(block, id, false);
            }
        }
        socket_.flush();
        block.sent = until;
    }
    return true;
}

void GvspSender::pace(Time& due, std::uint32_t packets) noexcept {
    if (session_->packet_interval_ns == 0) return;
    for (;;) {
        const std::uint32_t seen = wake_.value();
        const Time now = clock_.now();
        if (giving_up()) return;
        if (now >= due) {
            // A schedule that fell behind because rows were late is not made up for by a burst.
            if (now - due > ns_per_ms) due = now;
            break;
        }
        serve_resends();
        wake_.wait(seen, due);
    }
    due += session_->packet_interval_ns * packets;
}

void GvspSender::queue_packet(const Block& block, std::uint32_t id, bool resent) noexcept {
    if (socket_.queued() == PacketSocket::batch_packets) socket_.flush();
    std::uint8_t* header = headers_[socket_.queued()].data();
    const PacketFormat format = id == 0                       ? PacketFormat::leader
                                : id <= block.payload_packets ? PacketFormat::payload
                                                              : PacketFormat::trailer;
    const std::size_t n = write_gvsp_header(header, session_->config.extended_ids, Status::success,
                                            block.wire_id, format, id, resent);
    const std::span<const std::uint8_t> head{header, n};
    if (format == PacketFormat::leader) {
        socket_.add(head, {block.leader.data(), block.leader_bytes});
    } else if (format == PacketFormat::trailer) {
        socket_.add(head, {block.trailer.data(), block.trailer_bytes});
    } else {
        const std::size_t from = (id - 1) * session_->packet_payload;
        const std::size_t bytes = std::min(session_->packet_payload, block.bytes - from);
        const std::size_t image = std::clamp<std::size_t>(block.valid, from, from + bytes) - from;
        socket_.add(head, {block.data + from, image}, {session_->zeros.data(), bytes - image});
    }
}

void GvspSender::queue_error(const ResendRequest& request, Status status) noexcept {
    if (socket_.queued() == PacketSocket::batch_packets) socket_.flush();
    std::uint8_t* header = headers_[socket_.queued()].data();
    const std::size_t n = write_gvsp_header(header, session_->config.extended_ids, status, request.block_id,
                                            PacketFormat::payload, request.first, true);
    socket_.add({header, n}, {});
    counters_.resend_refused.fetch_add(1, std::memory_order_relaxed);
}

void GvspSender::serve_resends() noexcept {
    if (resends_.empty()) return;
    for (ResendRequest request; resends_.pop(request);)
        if (session_ != nullptr && session_->config.destination_port != 0) serve_resend(request);
    socket_.flush();
}

void GvspSender::serve_resend(const ResendRequest& request) noexcept {
    Block* found = nullptr;
    for (Block& b : session_->blocks)
        if (b.count != 0 && b.frame && b.wire_id == request.block_id) found = &b;
    if (found == nullptr) {
        queue_error(request, request.block_id > session_->frames ? Status::packet_not_yet_available
                                                                 : Status::packet_removed);
        return;
    }
    const std::uint32_t last_of_block = found->payload_packets + 1;
    if (request.first > last_of_block) {
        queue_error(request, Status::packet_unavailable);
        return;
    }
    const std::uint32_t last = std::min(request.last, last_of_block);
    for (std::uint32_t id = request.first; id <= last; ++id) {
        if (id >= found->sent) {
            // Of the block in work: the client takes this for "wait", any other refusal for "never".
            ResendRequest rest = request;
            rest.first = id;
            queue_error(rest, Status::packet_not_yet_available);
            return;
        }
        if (found->resent >= resend_budget * (found->payload_packets + 2)) {
            queue_error(request, Status::packet_unavailable);
            return;
        }
        ++found->resent;
        queue_packet(*found, id, true);
        counters_.resent_packets.fetch_add(1, std::memory_order_relaxed);
    }
}

bool GvspSender::leave_out(const Block& block, std::uint32_t id) const noexcept {
    if (loss_threshold_ == 0) return false;
    constexpr std::uint32_t effect = 0x47564C31; // sets this choice apart from other uses of the seed
    const auto words = philox4x32(
        {static_cast<std::uint32_t>(block.count), static_cast<std::uint32_t>(block.count >> 32), id, effect},
        philox_key(settings_.seed));
    return words[0] < loss_threshold_;
}

} // namespace obscura::transports::gige
