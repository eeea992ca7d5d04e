// SPDX-License-Identifier: Apache-2.0
// Kinds of faults injected into stream and control, and the rules that select when they occur.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

namespace obscura::transports::gige {

enum class Fault : std::uint8_t {
    lose,          ///< payload packets are withheld when first sent, not in resends
    lose_for_good, ///< payload packets are withheld and their resends refused
    duplicate,     ///< payload packets are sent twice
    reorder,       ///< a payload packet is sent after its successor
    delay,         ///< the sender pauses for `amount` us before a payload packet
    corrupt,       ///< one bit of a payload packet is inverted
    drop_leader,
    drop_trailer,
    skip_frame,      ///< the frame is not sent; its block id is missing
    wrong_block_id,  ///< the block id is `amount` too high
    wrong_timestamp, ///< the time stamp is `amount` us off
    /// Commands are not answered. The rule's frames are commands, counted from the start.
    mute_control,
    freeze_frame, ///< pixels of the last unaffected frame, new id and time stamp
    repeat_frame, ///< the full frame is sent once more under the next block id
    /// Commands do not restart the controller's heartbeat time-out. Counted like mute_control.
    heartbeat_loss,
};
constexpr std::size_t fault_count = 15;
/// Names in the configuration, in the order of messages and help: packets, frames, control.
constexpr auto enum_names(Fault /*type*/) {
    return std::array{
        EnumName{Fault::lose, "lose"},
        EnumName{Fault::lose_for_good, "lose_for_good"},
        EnumName{Fault::duplicate, "duplicate"},
        EnumName{Fault::reorder, "reorder"},
        EnumName{Fault::delay, "delay"},
        EnumName{Fault::corrupt, "corrupt"},
        EnumName{Fault::drop_leader, "drop_leader"},
        EnumName{Fault::drop_trailer, "drop_trailer"},
        EnumName{Fault::skip_frame, "skip_frame"},
        EnumName{Fault::freeze_frame, "freeze_frame"},
        EnumName{Fault::repeat_frame, "repeat_frame"},
        EnumName{Fault::wrong_block_id, "wrong_block_id"},
        EnumName{Fault::wrong_timestamp, "wrong_timestamp"},
        EnumName{Fault::mute_control, "mute_control"},
        EnumName{Fault::heartbeat_loss, "heartbeat_loss"},
    };
}
static_assert(enum_names(Fault{}).size() == fault_count);
/// What a kind of fault does, as clients show it.
constexpr std::string_view help_of(Fault fault) {
    switch (fault) {
    case Fault::lose:
        return "Payload packets are withheld when first sent, not in resends";
    case Fault::lose_for_good:
        return "Payload packets are withheld, and their resends refused";
    case Fault::duplicate:
        return "Payload packets are sent twice";
    case Fault::reorder:
        return "Payload packets are sent after their successors";
    case Fault::delay:
        return "The sender pauses for `amount` us before a payload packet";
    case Fault::corrupt:
        return "One bit of a payload packet is inverted";
    case Fault::drop_leader:
        return "The first packet of a frame is withheld";
    case Fault::drop_trailer:
        return "The last packet of a frame is withheld";
    case Fault::skip_frame:
        return "The frame is not sent; its block id is missing";
    case Fault::wrong_block_id:
        return "The block id is `amount` too high";
    case Fault::wrong_timestamp:
        return "The time stamp is `amount` us off";
    case Fault::mute_control:
        return "Commands are not answered";
    case Fault::freeze_frame:
        return "The frame shows the pixels of the last one that was not struck, under a new id and time stamp";
    case Fault::repeat_frame:
        return "The frame is sent once more under the next block id";
    case Fault::heartbeat_loss:
        return "Commands do not restart the heartbeat time-out of the controller";
    }
    return {};
}

/// One rule of [[gige.faults]]: what, when, how often. The same seed strikes the same packets in every run.
struct FaultRule {
    Fault fault = Fault::lose;
    double percent = 100;           ///< of the packets (frames, commands) in the window below
    std::uint64_t first_frame = 1;  ///< by block count since the stream channel was opened
    std::uint64_t last_frame = 0;   ///< 0: no end
    std::uint64_t every_frames = 1; ///< only every so many frames of the window
    std::uint32_t burst = 1;        ///< consecutive packets struck together (lose)
    double amount = 1;              ///< see Fault
    std::uint64_t seed = 0;         ///< 0: the camera's
    /// Counts its strikes: packets, frames or commands; null: they are not counted. Copies share it.
    std::shared_ptr<std::atomic<std::uint64_t>> struck{};
    /// Counts the strikes of all rules of its kind since the start, as `struck` does.
    std::shared_ptr<std::atomic<std::uint64_t>> struck_of_kind{};
};
/// Whether two rules select the same packets for the same fault, whatever they have struck.
[[nodiscard]] inline bool same_rule(const FaultRule& a, const FaultRule& b) {
    return a.fault == b.fault && a.percent == b.percent && a.first_frame == b.first_frame &&
           a.last_frame == b.last_frame && a.every_frames == b.every_frames && a.burst == b.burst &&
           a.amount == b.amount && a.seed == b.seed;
}

} // namespace obscura::transports::gige
