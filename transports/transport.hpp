// Read this first: a transport takes frames to the outside world while they are still being made.
#pragma once

#include "core/frame.hpp"
#include "core/heartbeat.hpp"
#include "core/ptp_status.hpp"
#include "core/time.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::transports {

/// What a transport has done since its start. Read from any thread; values may be a frame behind.
struct TransportCounters {
    std::uint64_t submitted = 0; ///< frames handed to it
    std::uint64_t delivered = 0; ///< frames that left completely
    std::uint64_t dropped = 0;   ///< frames it could not take or finish (queue full, no client, error)
    std::uint64_t bytes = 0;
};

/// Statistics of a transport by name, for whoever shows or stores them. Names are literals, in lower case
/// with underscores, with the unit at the end of the group's or the value's name.
struct TransportStatistics {
    struct Value {
        std::string_view name;
        std::variant<std::uint64_t, double> value;
    };
    struct Group {
        std::string_view name;
        std::vector<Value> values;
    };
    std::vector<Value> values;
    std::vector<Group> groups;
};

/// What only the producer can know, for Transport::notify().
enum class CameraEvent : std::uint8_t {
    trigger_missed, ///< an edge that will never be a frame
    error,          ///< a frame that could not be made
};

/// A way out for frames, with threads of its own.
class Transport {
public:
    virtual ~Transport() = default; ///< stops first if need be
    /// Short name of the kind of transport, a literal: "gige", "file", ... Names columns and sections of
    /// statistics.
    [[nodiscard]] virtual std::string_view kind() const = 0;
    /// Opens sockets, files or devices and starts the threads. Throws HardwareError or OutputError with one
    /// line.
    virtual void start() = 0;
    /// Finishes or abandons the frame in work and joins the threads; within 0.5 s.
    virtual void stop() = 0;
    /// Takes a reference to a frame that is about to be filled; rows become readable as the producer
    /// publishes them (Frame::wait_rows). Called by the pipeline thread: must not block, allocate, lock for
    /// long or throw. False when the frame was not taken; the transport counts it as dropped.
    virtual bool submit(const FrameRef& frame) noexcept = 0;
    /// Tells whoever listens at the other end, if this transport has a way to. `t`: scheduling clock. Any
    /// thread; must not block, lock, allocate or throw.
    virtual void notify(CameraEvent /*event*/, Time /*t*/, std::int64_t /*tai_offset_ns*/) noexcept {}
    [[nodiscard]] virtual TransportCounters counters() const noexcept = 0;
    /// The counters, followed by what this kind of transport has besides. Any thread; allocates.
    [[nodiscard]] virtual TransportStatistics statistics() const {
        const TransportCounters c = counters();
        return {{{"submitted", c.submitted},
                 {"delivered", c.delivered},
                 {"dropped", c.dropped},
                 {"bytes", c.bytes}},
                {}};
    }
    /// Of its threads; valid while it is started.
    [[nodiscard]] virtual Heartbeats heartbeats() const { return {}; }

    /// "ADDRESS:PORT" of the control protocol; empty: none. Valid after start().
    [[nodiscard]] virtual std::string control_address() const { return {}; }
    /// Where the state of the host's PTP clock is read, if this transport shows it. Before start(); `source`
    /// is called on a thread of the transport.
    virtual void set_ptp(std::function<PtpStatus()> /*source*/) {}

    /// Number of this transport among the camera's: its slot in TransmitTimestamps. Set before start().
    void set_transmit_slot(std::size_t slot) noexcept { transmit_slot_ = slot; }

protected:
    [[nodiscard]] std::size_t transmit_slot() const noexcept { return transmit_slot_; }

private:
    std::size_t transmit_slot_ = 0;
};

} // namespace obscura::transports
