// SPDX-License-Identifier: Apache-2.0
// Resends of the stream sender: packets of recent blocks that receivers ask for, within a budget.
#include "transports/gige/channels/gvsp_sender.hpp"

#include <algorithm>

namespace obscura::transports::gige {
namespace {

// Resend budget of a block, in multiples of its packets, against amplification by spoofed requests: {same
// host, other port; receiver or controller}, indexed by ResendRequest::trusted. The budgets are separate, so
// that untrusted requests do not use up that of the receiver.
constexpr std::array<std::uint32_t, 2> resend_budget{1, 4};

/// Packets that a request names; a range without an end counts as one.
std::uint64_t span_of(const ResendRequest& request) noexcept {
    return request.last == UINT32_MAX || request.last < request.first
               ? 1
               : std::uint64_t{request.last} - request.first + 1;
}

} // namespace

void GvspSender::resend(const ResendRequest& request) noexcept {
    counters_.resend_requests.fetch_add(1, std::memory_order_relaxed);
    if (resends_.push(request)) {
        wake_.notify();
    } else {
        counters_.asked_packets.fetch_add(span_of(request), std::memory_order_relaxed);
        note_resend(ResendOutcome::queue_full, span_of(request));
    }
}

void GvspSender::queue_error(const ResendRequest& request, Status status, std::uint16_t flags) noexcept {
    // A receiver may give the block up when it gets an error, so untrusted requests do not cause one.
    if (!request.trusted) return;
    if (socket_.queued() == PacketSocket::batch_packets) socket_.flush();
    std::uint8_t* header = headers_[socket_.queued()].data();
    const std::size_t n =
        write_gvsp_header(header, session_->config.extended_ids, session_->config.status_codes.shown(status),
                          request.block_id, PacketFormat::payload, request.first, true, flags);
    socket_.add({header, n}, {});
}

void GvspSender::serve_resends() noexcept {
    if (resends_.empty()) return;
    for (ResendRequest request; resends_.pop(request);)
        if (session_ != nullptr && session_->config.destination_port != 0)
            serve_resend(request);
        else
            refuse_unknown_block(request);
    socket_.flush();
}

void GvspSender::refuse_unknown_block(const ResendRequest& request) noexcept {
    counters_.asked_packets.fetch_add(span_of(request), std::memory_order_relaxed);
    note_resend(ResendOutcome::no_such_block, span_of(request));
}

void GvspSender::serve_resend(const ResendRequest& request) noexcept {
    Block* found = nullptr;
    // Truncated to the stream's 16-bit ids, an answer would name another block.
    const bool id_fits = session_->config.extended_ids || request.block_id <= 0xFFFF;
    for (Block& b : session_->blocks)
        if (id_fits && b.count != 0 && b.frame && b.wire_id == request.block_id) found = &b;
    const std::uint32_t last_of_block = found != nullptr ? found->payload.packets() + 1 : 0;
    const bool in_block = found != nullptr && request.first <= last_of_block;
    const std::uint32_t last = in_block ? std::min(request.last, last_of_block) : request.last;
    const std::uint64_t asked = in_block ? last - request.first + 1 : span_of(request);
    counters_.asked_packets.fetch_add(asked, std::memory_order_relaxed);
    // Receivers take a packet of a block long past for a jump of the stream and discard every block that
    // follows, so a spoofed request could stop the stream. The same holds for an answer about a block that
    // never existed.
    constexpr std::uint64_t recent = 64;
    const std::uint64_t newest = wire_block_id(session_->frames, session_->config.extended_ids);
    const std::uint64_t age = session_->config.extended_ids
                                  ? newest - request.block_id
                                  : (newest + 0xFFFF - request.block_id % 0xFFFF) % 0xFFFF;
    if (found == nullptr) {
        const bool sent_once =
            id_fits && session_->frames > 0 && request.block_id != 0 && age > 0 && age < session_->frames;
        note_resend(sent_once ? ResendOutcome::no_longer_kept : ResendOutcome::no_such_block, asked);
        if (sent_once && age <= recent) queue_error(request, Status::packet_removed);
        return;
    }
    if (!request.trusted && session_->frames - found->count > recent)
        return note_resend(ResendOutcome::no_longer_kept, asked);
    if (!in_block) {
        note_resend(ResendOutcome::no_such_packet, asked);
        queue_error(request, Status::packet_unavailable, gvsp_flag::resend_range_error);
        return;
    }
    for (std::uint32_t id = request.first; id <= last; ++id) {
        if (id >= found->sent) {
            // A packet that is not sent yet: the client waits on this status and gives up on any other.
            ResendRequest rest = request;
            rest.first = id;
            note_resend(ResendOutcome::before_sent, last - id + 1);
            queue_error(rest, Status::packet_not_yet_available);
            return;
        }
        if (found->resent[request.trusted] >=
            resend_budget[request.trusted] * (found->payload.packets() + 2)) {
            note_resend(ResendOutcome::over_budget, last - id + 1);
            queue_error(request, Status::packet_unavailable);
            return;
        }
        ++found->resent[request.trusted];
        if (fault(Fault::lose_for_good, *found, id) != nullptr) {
            ResendRequest gone = request;
            gone.first = id;
            note_resend(ResendOutcome::by_fault, 1);
            queue_error(gone, Status::packet_removed);
            continue;
        }
        queue_packet(*found, id, true);
        note_resend(ResendOutcome::resent, 1);
    }
}

} // namespace obscura::transports::gige
