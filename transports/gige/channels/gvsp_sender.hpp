// SPDX-License-Identifier: Apache-2.0
// GVSP stream sender: turns frames into packets on one thread and keeps the last blocks for resends.
#pragma once

#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/realtime/event_count.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "transports/gige/channels/message_channel.hpp"
#include "transports/gige/channels/packet_socket.hpp"
#include "transports/gige/channels/stream_port.hpp"
#include "transports/gige/settings.hpp"
#include "transports/gige/wire/gvsp.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

namespace obscura::transports::gige {

/// What became of a packet that a receiver asked for.
enum class ResendOutcome : std::uint8_t {
    resent,         ///< sent again
    before_sent,    ///< not sent yet when it was asked for: late, not lost
    no_longer_kept, ///< its frame has left the history
    by_fault,       ///< a rule of lose_for_good
    over_budget,    ///< the block's resend budget is used up
    no_such_packet, ///< id behind the end of the block
    no_such_block,  ///< id of a block that was not sent on this stream
    queue_full,     ///< more requests than the sender could read
};
constexpr std::size_t resend_outcome_count = 8;

/// Written by the sender, read from any thread.
struct SenderCounters {
    std::atomic<std::uint64_t> submitted{0}, delivered{0}, dropped{0};
    std::atomic<std::uint64_t> no_receiver{0};     ///< of those dropped: no client's stream was open
    std::atomic<std::uint64_t> resend_requests{0}; ///< commands
    std::atomic<std::uint64_t> asked_packets{0};   ///< packets that those commands name
    /// What became of the packets asked for, by ResendOutcome.
    std::array<std::atomic<std::uint64_t>, resend_outcome_count> resends{};
    std::atomic<std::uint64_t> injected_losses{0}, injected_delays{0};
    std::atomic<std::uint64_t> repeated_packets{0}; ///< see GigeSettings::keep_alive_ms
    std::atomic<std::int64_t> pace_ns{0};           ///< see Transport::pace_ns()
    /// Frames of the client's stream so far, by which fault rules count.
    std::atomic<std::uint64_t> stream_frames{0};
    /// Target of the latest stream: address << 16 | port, and bytes of a packet; 0: there was none.
    std::atomic<std::uint64_t> stream_target{0};
    std::atomic<std::uint32_t> packet_size{0};
    LatencyHistogram trigger_to_first, trigger_to_last;
};

/// Sends each block as its rows become ready and answers resend requests between batches, all on one thread,
/// so that packets of different origin never race. A block is in the history before its first packet is sent.
/// After start() the thread neither allocates, locks nor logs; begin() allocates on the control thread.
class GvspSender final : public StreamPort {
public:
    /// `slot`: index of the camera in TransmitTimestamps.
    GvspSender(const GigeSettings& settings, const NetworkInterface& network, MessageChannel& messages,
               const Clock& clock, const ThreadSettings& thread = {}, std::size_t slot = 0);
    ~GvspSender() override;

    /// Throws HardwareError.
    void start();
    void stop();
    /// Whether a client's stream is open.
    [[nodiscard]] bool streaming() const noexcept { return accepting_.load(std::memory_order_relaxed); }
    /// Pipeline thread. See Transport::submit().
    bool submit(const FrameRef& frame) noexcept;

    bool begin(const StreamConfig& config) override;
    void abort() noexcept override;
    [[nodiscard]] bool idle() const noexcept override;
    bool wait_idle(std::int64_t span_ns) noexcept override;
    void set_faults(FaultInjector faults) override;
    void resend(const ResendRequest& request) noexcept override;
    bool send_test_packet(const StreamConfig& config) noexcept override;
    [[nodiscard]] std::uint16_t source_port() const noexcept override { return socket_.port(); }

    [[nodiscard]] const SenderCounters& counters() const noexcept { return counters_; }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
    [[nodiscard]] const PacketSocket& socket() const noexcept { return socket_; }

private:
    /// A frame that is being sent or kept for resends.
    struct Block {
        FrameRef frame; // its pixels are sent
        // The submitted frame, while it is sent; differs from `frame` only under freeze_frame.
        FrameRef live;
        std::uint64_t count = 0;   // from 1; 0: unused
        std::uint64_t wire_id = 0; // block id on the wire
        std::uint16_t flags = 0;   // of its packets
        Payload payload;
        std::uint32_t sent = 0;              // packets with ids below this are sent or withheld by a fault
        std::optional<std::uint32_t> newest; // packet sent last without a fault
        // Packets resent so far, by ResendRequest::trusted.
        std::array<std::uint32_t, 2> resent{};
        std::array<std::uint8_t, gvsp_max_leader> leader{};
        std::array<std::uint8_t, gvsp_max_trailer> trailer{};
        std::size_t leader_bytes = 0, trailer_bytes = 0;
    };
    /// All that one acquisition needs, allocated before it starts.
    struct Session {
        StreamConfig config;
        std::size_t packet_payload = 0; // bytes of payload in a full packet
        std::int64_t packet_interval_ns = 0;
        PayloadType type = PayloadType::image;
        std::uint32_t batch = PacketSocket::batch_packets;
        std::vector<Block> blocks; // ring; the newest is blocks[(frames - 1) % size]
        std::vector<std::uint8_t> zeros;
        std::vector<std::uint8_t> scratch; // one packet, for corrupting it
        FrameRef shown;                    // with fault rules: the last frame sent without freeze_frame
        std::uint64_t last_frame_id = 0;   // id that the producer gave to the last frame
        std::uint64_t frames = 0;          // sent so far on this channel; the newest block's count
    };

    void loop();
    void install_session() noexcept;
    void take_faults() noexcept;
    void send_frame(FrameRef frame) noexcept;
    bool send_block(const FrameRef& frame, bool again) noexcept;
    bool prepare(Block& block, const FrameRef& frame) noexcept;
    bool send_payload(Block& block) noexcept;
    void wait_for_rows(const Block& block, std::uint32_t seen, Time& silent_since) noexcept;
    void write_trailer(Block& block) noexcept;
    void pace(Time& due, std::uint32_t packets) noexcept;
    void queue_packet(const Block& block, std::uint32_t id, bool resent, bool corrupt = false) noexcept;
    void queue_error(const ResendRequest& request, Status status, std::uint16_t flags = 0) noexcept;
    void serve_resends() noexcept;
    void serve_resend(const ResendRequest& request) noexcept;
    /// Counts a request that came without a stream, or for the stream before.
    void refuse_unknown_block(const ResendRequest& request) noexcept;
    /// Counts what became of `packets` packets asked for.
    void note_resend(ResendOutcome outcome, std::uint64_t packets) noexcept {
        counters_.resends[static_cast<std::size_t>(outcome)].fetch_add(packets, std::memory_order_relaxed);
    }
    void wait_out_delay(double delay_us) noexcept;
    void send_one(Block& block, std::uint32_t id) noexcept;
    void post(Event e, const Block& block, Time t) noexcept;
    [[nodiscard]] const FaultRule* fault(Fault f, const Block& block, std::uint32_t id = 0) const noexcept {
        return session_->config.faults.any() ? session_->config.faults.strikes(f, block.count, id) : nullptr;
    }
    /// Whether a rule for `f` strikes, counted.
    [[nodiscard]] bool struck(Fault f, const Block& block, std::uint32_t id = 0) const noexcept {
        const FaultRule* const rule = fault(f, block, id);
        if (rule != nullptr) FaultInjector::count(*rule);
        return rule != nullptr;
    }
    [[nodiscard]] bool giving_up() const noexcept {
        return abort_.load(std::memory_order_acquire) || quit_.load(std::memory_order_acquire);
    }

    const GigeSettings settings_;
    const std::int64_t keep_alive_ns_;
    const ThreadSettings thread_settings_;
    const NetworkInterface network_;
    const Clock& clock_;
    MessageChannel& messages_;
    const std::size_t slot_;
    PacketSocket socket_;
    SenderCounters counters_;

    EventCount wake_; // notifies the sender
    EventCount rest_; // notified by the sender when it is idle
    SpscRing<FrameRef, 8> queue_;
    SpscRing<ResendRequest, 256> resends_;
    std::atomic<bool> accepting_{false}, abort_{false}, quit_{false}, working_{false};
    std::atomic<Session*> incoming_{nullptr};
    /// Rules for the next frame, of the control thread until the sender takes them; those that they replace
    /// go back, as the sender must not free them.
    std::atomic<FaultInjector*> incoming_faults_{nullptr};
    SpscRing<FaultInjector*, 4> replaced_faults_;
    Session* session_ = nullptr;             // sender thread only, while it runs
    std::unique_ptr<Session> owned_session_; // control thread only

    std::array<std::array<std::uint8_t, gvsp_extended_header_bytes + gvsp_part_header_bytes>,
               PacketSocket::batch_packets>
        headers_{};
    Heartbeat heartbeat_{"gige-stream"};
    std::thread thread_;
};

} // namespace obscura::transports::gige
