// SPDX-License-Identifier: Apache-2.0
// Transport interface: sends frames to the outside world while their rows are produced. Read this first.
#pragma once

#include "core/camera/frame.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/time.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::transports {

/// Counters of a transport since its start; values may be a frame behind.
struct TransportCounters {
    std::uint64_t submitted = 0; ///< frames passed to submit()
    std::uint64_t delivered = 0; ///< frames sent completely
    /// Frames not accepted or not finished (queue full, no client, error).
    std::uint64_t dropped = 0;
    std::uint64_t bytes = 0;
};

/// Named statistics of a transport, for display or storage. Names are in lower case with underscores, with
/// the unit at the end of the group's or the value's name.
struct TransportStatistics {
    /// One number.
    struct Value {
        std::string name;
        std::variant<std::uint64_t, double> value;
    };
    /// Numbers that belong together.
    struct Group {
        std::string name;
        std::vector<Value> values;
    };
    /// What no number tells, such as the address of a receiver or why a device is not there.
    struct Text {
        std::string name, text;
    };
    std::vector<Value> values;
    std::vector<Group> groups;
    std::vector<Text> texts{};
};

/// Events on the producer's side that Transport::notify() reports to the receiver.
enum class CameraEvent : std::uint8_t {
    trigger_missed, ///< a trigger edge that produces no frame
    error,          ///< a frame that could not be produced
};

class DeviceFeatures; ///< transports/device_features.hpp
class FaultRules;     ///< transports/fault_rules.hpp

/// Sender of frames, with threads of its own.
class Transport {
public:
    virtual ~Transport() = default; ///< implementations stop first if they are started
    /// Short name of the kind of transport, a literal: "gige", "file", ... Names columns and sections of
    /// statistics.
    [[nodiscard]] virtual std::string_view kind() const = 0;
    /// Opens sockets, files or devices and starts the threads. Throws HardwareError or OutputError with a
    /// one-line message.
    virtual void start() = 0;
    /// Finishes or abandons the frame in progress and joins the threads; within 0.5 s.
    virtual void stop() = 0;
    /// Takes a reference to a frame that is about to be filled; rows become readable as the producer
    /// publishes them (Frame::wait_rows). Called by the pipeline thread: must not block, allocate, lock for
    /// long or throw. Returns false if the frame was not taken; the transport counts it as dropped.
    virtual bool submit(const FrameRef& frame) noexcept = 0;
    /// Reports `event` at time `t` (scheduling clock) to the receiver, if the protocol has such a message.
    /// Thread-safe, real-time safe.
    virtual void notify(CameraEvent /*event*/, Time /*t*/, std::int64_t /*tai_offset_ns*/) noexcept {}
    [[nodiscard]] virtual TransportCounters counters() const noexcept = 0;
    /// Whether it has a receiver at all times, so that a frame that it drops is a fault: a disk, not a client
    /// who may not be there.
    [[nodiscard]] virtual bool delivers_all() const noexcept { return false; }
    /// Time that the last frame's data takes at the pace to which the settings limit the transport; 0: no
    /// limit. Thread-safe.
    [[nodiscard]] virtual std::int64_t pace_ns() const noexcept { return 0; }
    /// The counters, followed by the statistics of this kind of transport. Thread-safe; allocates.
    [[nodiscard]] virtual TransportStatistics statistics() const {
        const TransportCounters c = counters();
        return {{{"submitted", c.submitted},
                 {"delivered", c.delivered},
                 {"dropped", c.dropped},
                 {"bytes", c.bytes}},
                {}};
    }
    /// Heartbeats of its threads, valid while it is started.
    [[nodiscard]] virtual Heartbeats heartbeats() const { return {}; }

    /// "ADDRESS:PORT" of the control protocol, valid after start(); empty: none.
    [[nodiscard]] virtual std::string control_address() const { return {}; }
    /// "ADDRESS:PORT" of the client that controls the camera through this transport; empty: none. Valid
    /// between start() and stop(). Thread-safe.
    [[nodiscard]] virtual std::string controller() const { return {}; }
    /// What run_between_commands() runs, with the controller() of that instant.
    using ControlWork = std::function<void(const std::string& controller)>;
    /// Runs `work` on the thread of the control protocol, which owns the settings of the camera, so that no
    /// command of a client comes in between. Returns once it has run, and rethrows what it throws. False,
    /// without effect: there is no such thread. Called between start() and stop(), not on that thread;
    /// thread-safe.
    [[nodiscard]] virtual bool run_between_commands(const ControlWork& /*work*/) { return false; }
    /// Injected faults of this transport; null: there are none. Valid between start() and stop().
    [[nodiscard]] virtual FaultRules* fault_rules() noexcept { return nullptr; }
    /// Features of its control protocol; null: it has none. Valid between start() and stop().
    [[nodiscard]] virtual DeviceFeatures* device_features() noexcept { return nullptr; }
    /// Takes control away from a client of the control protocol, if there is one: its acquisition ends, and
    /// the next client may take control. Called between start() and stop().
    virtual void release_control() {}

    /// Number of this transport among the camera's: its slot in TransmitTimestamps. Set before start().
    void set_transmit_slot(std::size_t slot) noexcept { transmit_slot_ = slot; }

protected:
    [[nodiscard]] std::size_t transmit_slot() const noexcept { return transmit_slot_; }

private:
    std::size_t transmit_slot_ = 0;
};

} // namespace obscura::transports
