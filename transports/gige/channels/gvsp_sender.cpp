// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/gvsp_sender.hpp"

#include "core/realtime/realtime.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace obscura::transports::gige {
namespace {

// Ethernet header, frame check, preamble and gap around each IP datagram.
constexpr std::int64_t ethernet_overhead_bytes = 38;
// Time span of a batch of paced packets: short enough for even spacing, long enough to outweigh the cost of a
// sleep.
constexpr std::int64_t paced_batch_ns = 100 * ns_per_us;

} // namespace

GvspSender::GvspSender(const GigeSettings& settings, const NetworkInterface& network,
                       MessageChannel& messages, const Clock& clock, const ThreadSettings& thread,
                       std::size_t slot)
    : settings_(settings),
      keep_alive_ns_(std::llround(settings.keep_alive_ms * static_cast<double>(ns_per_ms))),
      thread_settings_(thread),
      network_(network),
      clock_(clock),
      messages_(messages),
      slot_(slot) {}

GvspSender::~GvspSender() {
    stop();
    delete incoming_faults_.load();
    for (FaultInjector* replaced = nullptr; replaced_faults_.pop(replaced);)
        delete replaced;
}

void GvspSender::start() {
    socket_.open(network_, 4U << 20);
    socket_.set_backend(choose_backend(settings_.backend, network_));
    quit_.store(false);
    thread_ = std::thread([this] { loop(); });
}

void GvspSender::stop() {
    if (!thread_.joinable()) return;
    accepting_.store(false);
    quit_.store(true);
    wake_.notify();
    thread_.join();
    heartbeat_.rest();
    for (FrameRef left; queue_.pop(left);)
        counters_.dropped.fetch_add(1, std::memory_order_relaxed);
    session_ = nullptr;
    owned_session_.reset(); // returns the frames of the history to their pool
    socket_.close();
}

bool GvspSender::submit(const FrameRef& frame) noexcept {
    counters_.submitted.fetch_add(1, std::memory_order_relaxed);
    // Register first: rows may be published as soon as the frame is in the queue.
    const bool open = accepting_.load(std::memory_order_acquire);
    if (open && frame->add_waiter(wake_) && queue_.push(frame)) {
        wake_.notify();
        return true;
    }
    if (!open) counters_.no_receiver.fetch_add(1, std::memory_order_relaxed);
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
                              (config.extended_ids ? gvsp_extended_header_bytes : gvsp_header_bytes) -
                              (config.payload.multipart ? gvsp_part_header_bytes : 0);
    session->type = config.payload.multipart     ? PayloadType::multipart
                    : config.payload.chunks == 0 ? PayloadType::image
                    : config.chunk_in_image      ? PayloadType::image_with_chunks
                                                 : PayloadType::extended_chunk;
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
    session->scratch.resize(session->packet_payload);
    session->blocks.resize(static_cast<std::size_t>(std::max(settings_.history_frames, 1)) + 1);
    for (Block& b : session->blocks)
        b.payload.reserve(config.payload);

    if (config.continue_blocks && owned_session_) session->frames = owned_session_->frames;
    counters_.stream_frames.store(session->frames, std::memory_order_relaxed);
    counters_.stream_target.store(std::uint64_t{config.destination_ip} << 16 | config.destination_port,
                                  std::memory_order_relaxed);
    counters_.packet_size.store(config.packet_size, std::memory_order_relaxed);

    incoming_.store(session.get(), std::memory_order_release);
    for (const Time give_up = clock_.now() + ns_per_s;;) {
        const std::uint32_t seen = rest_.value();
        wake_.notify();
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
    wake_.notify();
}

bool GvspSender::idle() const noexcept {
    // In this order: the sender sets working_ before it takes a frame from the queue.
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

bool GvspSender::send_test_packet(const StreamConfig& config) noexcept {
    // Use another socket, because the stream's belongs to the sender thread. Same address, any source port.
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
    enter_thread(heartbeat_.name().c_str(), thread_settings_);
    while (!quit_.load(std::memory_order_acquire)) {
        heartbeat_.beat();
        const std::uint32_t seen = wake_.value();
        install_session();
        serve_resends();
        working_.store(true, std::memory_order_seq_cst);
        FrameRef frame;
        const bool got = queue_.pop(frame);
        if (got) send_frame(std::move(frame));
        working_.store(false, std::memory_order_seq_cst);
        if (got) {
            rest_.notify();
        } else {
            wake_.wait(seen, clock_.now() + Heartbeat::max_wait_ns);
        }
    }
    working_.store(false);
    rest_.notify();
}

void GvspSender::install_session() noexcept {
    Session* next = incoming_.load(std::memory_order_acquire);
    if (next == nullptr) return;
    session_ = next;
    socket_.set_destination(next->config.destination_ip, next->config.destination_port);
    socket_.set_do_not_fragment(next->config.do_not_fragment);
    for (ResendRequest stale; resends_.pop(stale);)
        refuse_unknown_block(stale);
    // Release the previous session: the control thread may free it from now on.
    incoming_.store(nullptr, std::memory_order_release);
    rest_.notify();
}

void GvspSender::set_faults(FaultInjector faults) {
    // At most one set of rules has been replaced since the last call.
    for (FaultInjector* replaced = nullptr; replaced_faults_.pop(replaced);)
        delete replaced;
    auto next = std::make_unique<FaultInjector>(std::move(faults));
    delete incoming_faults_.exchange(next.release(), std::memory_order_acq_rel);
}

void GvspSender::take_faults() noexcept {
    if (session_ == nullptr || incoming_faults_.load(std::memory_order_relaxed) == nullptr) return;
    FaultInjector* const next = incoming_faults_.exchange(nullptr, std::memory_order_acq_rel);
    if (next == nullptr) return;
    std::swap(session_->config.faults, *next);
    if (!session_->config.faults.any()) session_->shown = {};
    replaced_faults_.push(next);
}

void GvspSender::send_frame(FrameRef frame) noexcept {
    take_faults();
    const bool delivered = send_block(frame, false);
    (delivered ? counters_.delivered : counters_.dropped).fetch_add(1, std::memory_order_relaxed);
    if (!delivered || giving_up()) return;
    const FaultInjector& faults = session_->config.faults;
    if (const FaultRule* rule = faults.strikes(Fault::repeat_frame, session_->frames); rule != nullptr) {
        FaultInjector::count(*rule);
        send_block(frame, true);
    }
}

bool GvspSender::send_block(const FrameRef& frame, bool again) noexcept {
    if (session_ == nullptr || giving_up() || session_->config.destination_port == 0) return false;
    Block& block = session_->blocks[session_->frames % session_->blocks.size()];
    if (!prepare(block, frame)) return false;
    const Time edge = frame->info.trigger_edge;
    ++session_->frames; // puts the block into the history
    if (struck(Fault::skip_frame, block)) {
        block.frame = block.live = {};
        counters_.injected_losses.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    counters_.pace_ns.store(session_->packet_interval_ns * block.payload.packets(),
                            std::memory_order_relaxed);
    post(Event::frame_start, block, edge);
    if (!struck(Fault::drop_leader, block)) {
        queue_packet(block, 0, false);
        block.newest = 0;
    }
    socket_.flush();
    block.sent = 1;
    if (!again) {
        const Time now = clock_.now();
        counters_.trigger_to_first.add(now - edge);
        frame->info.note_transmit(slot_, now);
    }
    const bool sent = send_payload(block);
    block.live = {};
    if (!sent) return false;
    write_trailer(block);
    if (!struck(Fault::drop_trailer, block)) queue_packet(block, block.sent, false);
    socket_.flush();
    ++block.sent;
    if (session_->config.faults.any() && fault(Fault::freeze_frame, block) == nullptr)
        session_->shown = block.frame;
    if (again) return true;
    const Time now = clock_.now();
    counters_.trigger_to_last.add(now - edge);
    frame->info.note_transmit(slot_, now);
    // Report a frame that was cut short or repeats another.
    if (!frame->complete() || (frame->flags.load(std::memory_order_relaxed) & frame_repeated) != 0)
        post(Event::error, block, clock_.now());
    if ((frame->flags.load(std::memory_order_relaxed) & frame_degraded) != 0)
        post(Event::frame_degraded, block, clock_.now());
    const auto rows = frame->row_times();
    if (!rows.empty()) {
        post(Event::exposure_start, block, rows.front().reset);
        post(Event::exposure_end, block, rows.back().read);
    }
    return true;
}

bool GvspSender::prepare(Block& block, const FrameRef& frame) noexcept {
    block.sent = 0;
    block.newest.reset();
    block.resent = {};
    block.count = session_->frames + 1;
    counters_.stream_frames.store(block.count, std::memory_order_relaxed);
    // The producer also numbers frames that no transport accepted.
    const std::uint64_t before = std::exchange(session_->last_frame_id, frame->info.frame_id);
    block.flags = before != 0 && frame->info.frame_id > before + 1 ? gvsp_flag::previous_block_dropped : 0;
    std::uint64_t shown_id = block.count;
    if (const FaultRule* rule = fault(Fault::wrong_block_id, block)) {
        FaultInjector::count(*rule);
        shown_id += static_cast<std::uint64_t>(static_cast<std::int64_t>(rule->amount));
    }
    block.wire_id = wire_block_id(shown_id, session_->config.extended_ids);
    block.live = block.frame = frame;
    const FrameRef& old = session_->shown;
    if (old && old->info.width == frame->info.width && old->info.height == frame->info.height &&
        old->info.pixel_format == frame->info.pixel_format && struck(Fault::freeze_frame, block))
        block.frame = old;
    // Geometry and chunks describe the pixels sent, the time stamp is that of the submitted frame's trigger.
    const FrameInfo& info = block.frame->info;
    if (!block.payload.begin(*block.frame, info.frame_id, session_->packet_payload)) {
        block.frame = block.live = {};
        return false;
    }
    auto stamp = static_cast<std::uint64_t>(frame->info.trigger_edge.ns + frame->info.tai_offset_ns -
                                            session_->config.payload.timestamp_origin_ns);
    if (const FaultRule* rule = fault(Fault::wrong_timestamp, block)) {
        FaultInjector::count(*rule);
        stamp += static_cast<std::uint64_t>(static_cast<std::int64_t>(rule->amount * 1000));
    }
    block.leader_bytes = session_->type == PayloadType::multipart
                             ? write_multipart_leader(block.leader.data(), info, block.payload.parts(), stamp)
                             : write_image_leader(block.leader.data(), session_->type, info.pixel_format,
                                                  block.payload.image(), stamp);
    block.trailer_bytes = 0;
    return true;
}

void GvspSender::write_trailer(Block& block) noexcept {
    block.trailer_bytes =
        session_->type == PayloadType::multipart
            ? write_multipart_trailer(block.trailer.data())
            : write_image_trailer(block.trailer.data(), session_->type, block.payload.image().height,
                                  block.payload.bytes(), block.payload.chunks());
}

bool GvspSender::send_payload(Block& block) noexcept {
    const std::uint32_t end = block.payload.packets() + 1; // payload has the ids 1 .. end - 1
    std::uint32_t held = 0;                                // id delayed by a reorder fault; 0: none
    Time due = clock_.now();
    Time silent_since = due;
    while (block.sent < end) {
        const std::uint32_t seen = wake_.value();
        if (giving_up()) return false;
        serve_resends();
        block.payload.update(*block.frame);
        std::uint32_t ready = block.payload.ready_packets();
        // Send a frozen image at the pace of the submitted frame's readout.
        const Frame& live = *block.live;
        if (&live != block.frame.get() && !live.complete() && !live.abandoned())
            ready = std::min(ready, static_cast<std::uint32_t>(std::uint64_t{block.payload.packets()} *
                                                               static_cast<std::uint32_t>(live.rows_ready()) /
                                                               static_cast<std::uint32_t>(live.info.height)));
        const std::uint32_t until = std::min({block.sent + session_->batch, ready + 1, end});
        heartbeat_.beat();
        if (until <= block.sent) {
            wait_for_rows(block, seen, silent_since);
            continue;
        }
        pace(due, until - block.sent);
        for (std::uint32_t id = block.sent; id < until; ++id) {
            block.sent = id; // requests are served while a fault delays this packet
            // A reordered packet waits for its successor, which may be in another batch.
            if (held == 0 && id + 1 < end && struck(Fault::reorder, block, id)) {
                held = id;
                continue;
            }
            send_one(block, id);
            if (held != 0) send_one(block, std::exchange(held, 0U));
        }
        socket_.flush();
        block.sent = until;
        silent_since = clock_.now();
    }
    return true;
}

// Receivers give a block up that they have heard nothing of for a while (Aravis: 100 ms), so the newest
// packet is sent once more while rows are late. A receiver takes it for a copy made by the network and
// discards it.
void GvspSender::wait_for_rows(const Block& block, std::uint32_t seen, Time& silent_since) noexcept {
    const Time now = clock_.now();
    Time until = now + Heartbeat::max_wait_ns;
    if (keep_alive_ns_ > 0 && block.newest) {
        if (now - silent_since >= keep_alive_ns_) {
            queue_packet(block, *block.newest, false);
            socket_.flush();
            counters_.repeated_packets.fetch_add(1, std::memory_order_relaxed);
            silent_since = now;
        }
        until = std::min(until, silent_since + keep_alive_ns_);
    }
    wake_.wait(seen, until);
}

void GvspSender::pace(Time& due, std::uint32_t packets) noexcept {
    if (session_->packet_interval_ns == 0) return;
    for (;;) {
        const std::uint32_t seen = wake_.value();
        const Time now = clock_.now();
        if (giving_up()) return;
        if (now >= due) {
            // Restart a schedule that fell behind because rows were late: catching up would be a burst.
            if (now - due > ns_per_ms) due = now;
            break;
        }
        serve_resends();
        heartbeat_.beat();
        wake_.wait(seen, std::min(due, now + Heartbeat::max_wait_ns));
    }
    due += session_->packet_interval_ns * packets;
}

void GvspSender::queue_packet(const Block& block, std::uint32_t id, bool resent, bool corrupt) noexcept {
    // A corrupted packet that is still queued occupies the scratch buffer.
    if (corrupt) socket_.flush();
    if (socket_.queued() == PacketSocket::batch_packets) socket_.flush();
    std::uint8_t* header = headers_[socket_.queued()].data();
    const bool multipart = block.payload.multipart();
    const PacketFormat format = id == 0                        ? PacketFormat::leader
                                : id > block.payload.packets() ? PacketFormat::trailer
                                : multipart                    ? PacketFormat::multipart
                                                               : PacketFormat::payload;
    std::size_t n = write_gvsp_header(header, session_->config.extended_ids, Status::success, block.wire_id,
                                      format, id, resent, block.flags);
    if (format == PacketFormat::leader) {
        if (multipart) set_part_count(header, block.payload.parts().size());
        socket_.add({header, n}, {block.leader.data(), block.leader_bytes});
    } else if (format == PacketFormat::trailer) {
        socket_.add({header, n}, {block.trailer.data(), block.trailer_bytes});
    } else {
        std::size_t offset = 0;
        Payload::Pieces pieces = block.payload.packet(id - 1, session_->zeros, offset);
        if (multipart) {
            const Payload::Part& part = block.payload.part_of(id - 1);
            n +=
                write_part_header(header + n, static_cast<std::uint8_t>(&part - block.payload.parts().data()),
                                  offset, id == part.first_packet + part.packets);
        }
        if (corrupt) {
            std::size_t bytes = 0;
            for (const auto& piece : pieces) {
                std::copy(piece.begin(), piece.end(),
                          session_->scratch.begin() + static_cast<std::ptrdiff_t>(bytes));
                bytes += piece.size();
            }
            session_->scratch[bytes / 2] ^= 0x10;
            pieces = {std::span<const std::uint8_t>(session_->scratch).first(bytes)};
        }
        socket_.add({header, n}, pieces[0], pieces[1], pieces[2]);
        if (corrupt) socket_.flush();
    }
}

void GvspSender::send_one(Block& block, std::uint32_t id) noexcept {
    if (!session_->config.faults.any()) {
        queue_packet(block, id, false);
        block.newest = id;
        return;
    }
    if (struck(Fault::lose, block, id) || struck(Fault::lose_for_good, block, id)) {
        counters_.injected_losses.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    if (const FaultRule* rule = fault(Fault::delay, block, id)) {
        FaultInjector::count(*rule);
        counters_.injected_delays.fetch_add(1, std::memory_order_relaxed);
        wait_out_delay(rule->amount);
    }
    const bool corrupt = struck(Fault::corrupt, block, id);
    queue_packet(block, id, false, corrupt);
    if (!corrupt) block.newest = id;
    if (struck(Fault::duplicate, block, id)) queue_packet(block, id, false);
}

void GvspSender::wait_out_delay(double delay_us) noexcept {
    socket_.flush();
    for (const Time until = clock_.now() + static_cast<std::int64_t>(delay_us * ns_per_us); !giving_up();) {
        const std::uint32_t seen = wake_.value();
        const Time now = clock_.now();
        if (now >= until) break;
        heartbeat_.beat(); // a client sets the delay: a long one is no hung thread
        serve_resends();
        wake_.wait(seen, std::min(until, now + Heartbeat::max_wait_ns));
    }
}

void GvspSender::post(Event e, const Block& block, Time t) noexcept {
    messages_.post({e, block.wire_id,
                    static_cast<std::uint64_t>(t.ns + block.frame->info.tai_offset_ns -
                                               session_->config.payload.timestamp_origin_ns)});
}

} // namespace obscura::transports::gige
