// SPDX-License-Identifier: Apache-2.0
// Status reporting of IEEE 488.2 and SCPI-1999: event registers, status byte, error queue.
#pragma once

#include "instrument/scpi/errors.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

namespace obscura::instrument {

/// Bits of the standard event status register (*ESR?).
enum EventBit : std::uint8_t {
    event_operation_complete = 1 << 0,
    event_query_error = 1 << 2,
    event_device_error = 1 << 3,
    event_execution_error = 1 << 4,
    event_command_error = 1 << 5,
    event_power_on = 1 << 7,
};

/// Bits of STATus:OPERation.
enum OperationBit : std::uint16_t {
    operation_measuring = 1 << 4,  ///< a camera acquires
    operation_waiting = 1 << 5,    ///< a camera waits for a trigger
    operation_controlled = 1 << 8, ///< a GigE Vision client controls a camera
    operation_triggering = 1 << 9, ///< a trigger of this connection has no outcome yet
};

/// Bits of STATus:QUEStionable.
enum QuestionableBit : std::uint16_t {
    questionable_time = 1 << 2,    ///< the clock of a camera's trigger is in holdover
    questionable_verdict = 1 << 9, ///< the verdict on a camera is NOT GOOD
    questionable_lost = 1 << 10,   ///< the daemon does not answer
};

/// Condition, event and enable register of STATus:OPERation or STATus:QUEStionable. Events are bits that
/// went from 0 to 1 between two looks at the condition.
struct StatusRegister {
    std::uint16_t condition = 0, event = 0, enable = 0;

    void look(std::uint16_t now) noexcept {
        event = static_cast<std::uint16_t>(event | (now & ~condition));
        condition = now;
    }
    [[nodiscard]] std::uint16_t take_event() noexcept {
        const std::uint16_t taken = event;
        event = 0;
        return taken;
    }
    [[nodiscard]] bool summary() const noexcept { return (event & enable) != 0; }
};

/// Status of one connection. Thread-bound.
class Status {
public:
    static constexpr std::size_t queue_length = 32;
    static constexpr std::size_t max_text_bytes = 255; ///< of an error, SCPI-1999 21.8

    StatusRegister operation, questionable;
    std::uint8_t event_enable = 0, service_enable = 0;

    /// Puts an error into the queue and sets its bit of the event register; the last place of a full queue
    /// says that it is full.
    void report(ScpiCode code, std::string detail = {});
    void set_event(EventBit bit) noexcept { event_ = static_cast<std::uint8_t>(event_ | bit); }
    /// *ESR?: reading clears it.
    [[nodiscard]] std::uint8_t take_event() noexcept;
    /// SYSTem:ERRor?: number and quoted text of the oldest error; 0,"No error" if there is none.
    [[nodiscard]] std::string take_error();
    [[nodiscard]] std::size_t errors() const noexcept { return queue_.size(); }
    /// *STB?: `message_available`: the answer so far is not empty.
    [[nodiscard]] std::uint8_t status_byte(bool message_available) const noexcept;
    /// *CLS: queue and event registers.
    void clear() noexcept;
    /// STATus:PRESet
    void preset() noexcept { operation.enable = questionable.enable = 0; }

private:
    struct Queued {
        ScpiCode code;
        std::string detail;
    };
    std::deque<Queued> queue_;
    std::uint8_t event_ = event_power_on;
};

} // namespace obscura::instrument
