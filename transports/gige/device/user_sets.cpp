// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/user_sets.hpp"

#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/regions.hpp"
#include "transports/gige/device/sequencer_control.hpp"
#include "transports/gige/device/stream_channel.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <sstream>

namespace obscura::transports::gige {
namespace {

bool binned(const std::string& text) {
    std::istringstream lines(text);
    lines >> std::hex;
    for (std::uint32_t address = 0, word = 0; lines >> address >> word;)
        if ((address == address_of("BinningHorizontal") || address == address_of("BinningVertical")) &&
            word > 1)
            return true;
    return false;
}

} // namespace

std::string saved_features(const DeviceContext& d) {
    std::string text;
    for (const Register& r : d.bank.table()) {
        std::uint32_t word = 0;
        if (r.saved && d.bank.read_word(r.address, word) == Status::success)
            text += fmt::format("{:#x} {:#x}\n", r.address, word);
    }
    return text;
}

Status load_features(DeviceContext& d, const std::string& text) {
    if (d.control.acquiring()) return Status::write_protect;
    // Binning excludes multi-part payload, which is a setting of the stream, not of user sets.
    if (multipart(d) && binned(text)) return Status::write_protect;
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
    std::istringstream lines(text);
    lines >> std::hex;
    for (std::uint32_t address = 0, word = 0; lines >> address >> word;) {
        const Register* r = d.bank.find(address);
        if (r != nullptr && r->address == address && r->saved) d.bank.write_word(address, word);
    }
    return Status::success;
}

void read_state_file(DeviceContext& d) {
    if (d.settings.state_file.empty()) return;
    std::ifstream file(d.settings.state_file);
    std::string name, line;
    bool loads_user_set_1 = false;
    while (std::getline(file, line)) {
        if (line.rfind("name ", 0) == 0) {
            name = line.substr(5);
        } else if (line == "default 1") {
            loads_user_set_1 = true;
        } else if (line.rfind("0x", 0) == 0) {
            d.user_set_1 += line + "\n";
        }
    }
    if (!name.empty()) d.bank.set_text(reg::user_name, name);
    store(d, "UserSetDefault", 0, loads_user_set_1 ? 1 : 0);
    if (loads_user_set_1) load_features(d, d.user_set_1);
}

bool write_state_file(const DeviceContext& d) {
    if (d.settings.state_file.empty()) return true;
    // Write a new file and rename it, so that the state file always holds either the old sets or the new
    // ones.
    const std::string beside = d.settings.state_file + ".new";
    const std::string text = fmt::format("name {}\ndefault {}\n{}", d.bank.text(reg::user_name),
                                         stored(d, "UserSetDefault"), d.user_set_1);
    const int fd = open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) return false;
    const bool written =
        ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(fd) == 0;
    close(fd);
    return written && std::rename(beside.c_str(), d.settings.state_file.c_str()) == 0;
}

} // namespace obscura::transports::gige
