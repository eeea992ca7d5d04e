// The Ptp* features: state of the machine's PTP clock, live or as it was at the last latch.
#include "transports/gige/device/device.hpp"
#include "transports/gige/registers/features.hpp"

namespace obscura::transports::gige {

void Device::add_ptp() {
    const auto now = [this] { return ptp_ ? ptp_() : PtpStatus{}; };
    const auto word = [this](std::string_view name, std::uint32_t address,
                             std::function<std::uint32_t()> read) {
        bank_.add({.name = name, .address = address, .read = std::move(read)});
    };
    // The bootstrap registers tell the same.
    word("GevIEEE1588Status", reg::ptp_status,
         [this, now] { return static_cast<std::uint32_t>(ptp_ ? now().state : PtpState::disabled); });
    const auto where_ptp_is = [this](std::uint32_t value) {
        return [this, value] { return ptp_ ? value : 0U; };
    };
    word("GevIEEE1588ExtendedCapability", reg::ptp_extended_capability,
         where_ptp_is(ptp_capability::profile_registers));
    word("GevIEEE1588SupportedProfiles", reg::ptp_supported_profiles,
         where_ptp_is(ptp_capability::default_profile));
    word("GevIEEE1588SelectedProfile", reg::ptp_selected_profile, [] { return 0U; });
    word("PtpEnable", feature::ptp_enable, [this] { return std::uint32_t{ptp_ != nullptr}; });
    word("PtpStatus", feature::ptp_state, [now] { return static_cast<std::uint32_t>(now().state); });
    word("PtpServoStatus", feature::ptp_servo, [now] { return std::uint32_t{now().locked}; });
    command("PtpDataSetLatch", feature::ptp_data_set_latch, [this, now] {
        ptp_latched_ = now();
        return Status::success;
    });
    word("PtpClockAccuracy", feature::ptp_accuracy,
         [this] { return std::uint32_t{ptp_latched_.clock_accuracy}; });
    word("PtpUtcOffset", feature::ptp_utc_offset,
         [this] { return static_cast<std::uint32_t>(ptp_latched_.utc_offset_s); });
    // The words of one latch belong together, however they are read.
    const auto two_words = [&](std::string_view name, std::uint32_t address, auto PtpStatus::*member) {
        word(name, address, [this, member] {
            return static_cast<std::uint32_t>(static_cast<std::uint64_t>(ptp_latched_.*member) >> 32);
        });
        word(name, address + 4, [this, member] { return static_cast<std::uint32_t>(ptp_latched_.*member); });
    };
    two_words("PtpOffsetFromMaster", feature::ptp_offset, &PtpStatus::offset_ns);
    two_words("PtpMeanPropagationDelay", feature::ptp_path_delay, &PtpStatus::path_delay_ns);
    two_words("PtpClockID", feature::ptp_clock_id, &PtpStatus::clock_id);
    two_words("PtpParentClockID", feature::ptp_parent_id, &PtpStatus::parent_id);
    two_words("PtpGrandmasterClockID", feature::ptp_grandmaster_id, &PtpStatus::grandmaster_id);
}

} // namespace obscura::transports::gige
