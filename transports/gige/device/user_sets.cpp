// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/user_sets.hpp"

#include "core/io/path_state.hpp"
#include "core/io/temporary_name.hpp"
#include "core/realtime/log.hpp"
#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/regions.hpp"
#include "transports/gige/device/sequencer_control.hpp"
#include "transports/gige/device/stream_channel.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

namespace obscura::transports::gige {
namespace {

bool binned(const std::vector<SavedWord>& set) {
    return std::any_of(set.begin(), set.end(), [](const SavedWord& saved) {
        return (saved.address == address_of("BinningHorizontal") ||
                saved.address == address_of("BinningVertical")) &&
               saved.word > 1;
    });
}

// Writes the words of a set as a client would, after the features that would keep others from being set are
// reset. Returns the number of words that were refused.
std::size_t apply_set(DeviceContext& d, const std::vector<SavedWord>& set) {
    publish_sequence(d, {});
    d.sequencer_configuring = false;
    d.bank.write_word(address_of("ExposureAuto"), value(ExposureAuto::off)); // locks ExposureTime
    // Disable all regions but the first and set offsets to 0, so that any width and height fit; words that do
    // not fit the sensor are refused and change nothing.
    for (std::uint32_t i = region_count(d); i-- > 1;)
        d.bank.write_word(address_of("RegionMode", i), 0);
    for (std::uint32_t i = 0; i < region_count(d); ++i) {
        d.bank.write_word(address_of("OffsetX", i), 0);
        d.bank.write_word(address_of("OffsetY", i), 0);
    }
    // Several reads of one window cannot be binned.
    d.bank.write_word(address_of("RegionSampling"), value(Sampling::destructive));
    std::size_t refused = 0;
    for (const SavedWord& saved : set) {
        const Register* r = d.bank.find(saved.address);
        const bool known = r != nullptr && r->address == saved.address && r->saved;
        if (!known || d.bank.write_word(saved.address, saved.word) != Status::success) ++refused;
    }
    return refused;
}

} // namespace

std::vector<SavedWord> saved_features(const DeviceContext& d) {
    std::vector<SavedWord> set;
    for (const Register& r : d.bank.table()) {
        std::uint32_t word = 0;
        if (!r.saved || d.bank.read_word(r.address, word) != Status::success) continue;
        set.push_back({r.address, r.kept ? r.kept() : word});
    }
    return set;
}

Status load_features(DeviceContext& d, const std::vector<SavedWord>& set) {
    if (d.control.acquiring()) return Status::write_protect;
    // Binning excludes multi-part payload, which is a setting of the stream, not of user sets.
    if (multipart(d) && binned(set)) return Status::write_protect;
    apply_set(d, set);
    return Status::success;
}

Status load_default_set(DeviceContext& d) {
    const Status status = load_features(d, d.default_set);
    const bool other = stored(d, "UserSetDefault") != 0 && !d.user_set_1.empty();
    return other && status == Status::success ? load_features(d, d.user_set_1) : status;
}

void read_state_file(DeviceContext& d) {
    const std::string& file = d.settings.state_file;
    if (file.empty()) return;
    remove_left_temporaries(file);
    DeviceState state;
    if (const std::string why = read_state(file, state); !why.empty()) {
        log_warning("gige.state_file: {}: {}; not used, and left as it is: user sets are not kept", file,
                    why);
        d.state_file_usable = false;
        return;
    }
    d.state_in_file = state;
    if (!state.user_id.empty()) d.bank.set_text(reg::user_name, state.user_id);
    d.user_set_1 = std::move(state.user_set_1);
    if (state.user_set_default == 0) return;
    if (!in_range(feature("UserSetDefault"), state.user_set_default)) {
        log_warning("gige.state_file: {}: UserSetDefault {} does not exist; Default is loaded", file,
                    state.user_set_default);
        return;
    }
    store(d, "UserSetDefault", 0, state.user_set_default);
    if (const std::size_t refused = apply_set(d, d.user_set_1); refused > 0)
        log_warning(
            "gige.state_file: {}: {} of {} registers of UserSet1 do not fit this camera and keep their reset values",
            file, refused, d.user_set_1.size());
}

bool write_state_file(DeviceContext& d) {
    d.state_changed = false;
    const std::string& file = d.settings.state_file;
    if (file.empty()) return true;
    if (!d.state_file_usable) return false;
    DeviceState state{d.bank.text(reg::user_name), stored(d, "UserSetDefault"), d.user_set_1};
    if (state == d.state_in_file && path_exists(file)) return true;
    if (d.before_disk) d.before_disk();
    const std::string why = write_state(file, state);
    if (!why.empty()) log_warning("gige.state_file: {}: {}", file, why);
    if (why.empty()) d.state_in_file = std::move(state);
    return why.empty();
}

} // namespace obscura::transports::gige
