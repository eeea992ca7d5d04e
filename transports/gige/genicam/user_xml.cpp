// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/user_xml.hpp"

#include "core/error.hpp"
#include "core/text/text.hpp"
#include "transports/gige/genicam/xml_presets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <utility>

namespace obscura::transports::gige {
namespace {

/// Largest distance of an indexed register from its address for the first item of the selector.
constexpr std::uint64_t indexed_reach = 0x10000;
constexpr std::size_t pages_max = 4096; // 16 MiB

/// Word for an unknown entry of an enumeration; every register refuses it.
constexpr std::uint32_t unknown_choice = 0xFFFFFFFF;

bool overlap(std::uint64_t a_begin, std::uint64_t a_end, std::uint64_t b_begin, std::uint64_t b_end) {
    return a_begin < b_end && b_begin < a_end;
}

} // namespace

std::vector<UserXml::Target> UserXml::make_targets(std::span<const FeatureCategory> table) {
    std::vector<const Feature*> bound;
    for (const FeatureCategory& category : table)
        for (const Feature& f : category.features)
            if (f.foreign.bound) bound.push_back(&f);
    // Sort: strings, then values by rank, because values depend on those of lower rank, then commands.
    const auto rank = [](const Feature* f) {
        const int group = f->type == FeatureType::string ? 0 : f->type == FeatureType::command ? 2 : 1;
        return std::pair{group, f->foreign.rank};
    };
    std::stable_sort(bound.begin(), bound.end(),
                     [&](const Feature* a, const Feature* b) { return rank(a) < rank(b); });
    std::vector<Target> targets;
    for (const Feature* f : bound) {
        Target t;
        t.name = f->name;
        t.feature = f;
        t.kind = f->type == FeatureType::command  ? Target::Kind::command
                 : f->type == FeatureType::string ? Target::Kind::text
                 : f->access == Access::read_only ? Target::Kind::shown
                                                  : Target::Kind::setting;
        t.entries = f->foreign.entries.empty() ? f->entries : f->foreign.entries;
        // Bind the first of several triggers or regions.
        const Feature* selector = f->selectors[0].empty() ? nullptr : find_feature(table, f->selectors[0]);
        if (selector != nullptr && selector->entries.size() > 1) {
            t.selector = selector->name;
            t.selected = selector->entries.front().name;
        }
        targets.push_back(t);
        for (const std::string_view other : f->foreign.other_names)
            if (!other.empty()) {
                t.name = other;
                targets.push_back(t);
            }
    }
    return targets;
}

UserXml::UserXml(const std::string& file, std::string xml, const std::string& values, RegisterBank& native,
                 std::span<const FeatureCategory> table)
    : name_(std::filesystem::path(file).filename().string()),
      xml_(std::move(xml)),
      native_(native),
      targets_(make_targets(table)) {
    const auto quiet = GenicamEngine::suppress_messages();
    try {
        engine_ = std::make_unique<GenicamEngine>(xml_, static_cast<GenicamEngine::Memory&>(*this));
    } catch (const ConfigError& e) {
        throw ConfigError(fmt::format("gige.xml: {}: {}", file, e.what()));
    }
    map_registers();
    bind();
    preset(file, values);
}

std::string UserXml::url() const {
    // The name is informative; leave out characters that a URL cannot contain.
    std::string name;
    // Clients unpack what is called .zip, and an archive is served unpacked.
    const bool archive = lower_case(name_).ends_with(".zip");
    for (const char c : archive ? name_.substr(0, name_.size() - 4) + ".xml" : name_)
        if ((std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.') &&
            name.size() < 60)
            name += c;
    return fmt::format("Local:{};{:X};{:X}", name, xml_address_, xml_.size());
}

void UserXml::map_registers() {
    ranges_ = engine_->registers();
    std::sort(ranges_.begin(), ranges_.end(), [](const auto& a, const auto& b) { return a.begin < b.begin; });
    for (const auto& r : ranges_) {
        max_range_ = std::max(max_range_, r.end - r.begin);
        if (r.begin < manufacturer_begin) continue;
        const std::uint64_t last =
            std::min<std::uint64_t>(r.end - 1 + (r.indexed ? indexed_reach : 0), UINT32_MAX);
        for (std::uint64_t page = r.begin / page_bytes; page <= last / page_bytes; ++page)
            known_pages_[page] = true;
    }
    // Place the file itself at a free address.
    const std::uint64_t room = (xml_.size() + page_bytes) / page_bytes;
    for (xml_address_ = 0x0010'0000; xml_address_ < 0xF000'0000; xml_address_ += 0x0010'0000) {
        const auto next = known_pages_.lower_bound(xml_address_ / page_bytes);
        if (next == known_pages_.end() || next->first >= xml_address_ / page_bytes + room) break;
    }
}

bool UserXml::known(std::uint64_t address) const {
    if (address >= manufacturer_begin && address <= UINT32_MAX)
        return known_pages_.count(address / page_bytes) != 0;
    return std::any_of(ranges_.begin(), ranges_.end(),
                       [&](const auto& r) { return address >= r.begin && address < r.end; });
}

bool UserXml::may_write(std::uint64_t address, std::size_t bytes) const {
    // A byte is writable if one of its registers is, or if it belongs to none (indexed registers).
    for (std::uint64_t at = address; at < address + bytes; ++at) {
        bool named = false, writable = false;
        auto r = std::lower_bound(ranges_.begin(), ranges_.end(), at >= max_range_ ? at - max_range_ : 0,
                                  [](const auto& range, std::uint64_t a) { return range.begin < a; });
        for (; r != ranges_.end() && r->begin <= at; ++r) {
            if (at >= r->end) continue;
            named = true;
            writable = writable || r->writable;
        }
        if (named && !writable) return false;
    }
    return true;
}

std::uint8_t* UserXml::cell(std::uint64_t address, bool create) {
    auto page = pages_.find(address / page_bytes);
    if (page == pages_.end()) {
        if (!create || pages_.size() >= pages_max) return nullptr;
        page = pages_.try_emplace(address / page_bytes).first;
    }
    return &page->second[address % page_bytes];
}

std::uint8_t UserXml::peek(std::uint64_t address) const {
    const auto page = pages_.find(address / page_bytes);
    return page == pages_.end() ? std::uint8_t{0} : page->second[address % page_bytes];
}

bool UserXml::load(std::uint64_t address, std::span<std::uint8_t> out) {
    if (address + out.size() > std::uint64_t{UINT32_MAX} + 1) return false;
    if (noting_loads_ != nullptr) noting_loads_->push_back({address, address + out.size(), false, false});
    if (recording_ != nullptr) {
        std::fill(out.begin(), out.end(), fill_);
        return true;
    }
    if (address < manufacturer_begin && native_.find(static_cast<std::uint32_t>(address)) != nullptr)
        return native_.read(static_cast<std::uint32_t>(address), out) == Status::success;
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (!known(address + i)) return false;
        out[i] = peek(address + i);
    }
    return true;
}

bool UserXml::store(std::uint64_t address, std::span<const std::uint8_t> bytes) {
    if (address + bytes.size() > std::uint64_t{UINT32_MAX} + 1) return false;
    if (recording_ != nullptr) {
        recording_->push_back({address, {bytes.begin(), bytes.end()}});
        return true;
    }
    if (address < manufacturer_begin && native_.find(static_cast<std::uint32_t>(address)) != nullptr) {
        std::size_t done = 0;
        return native_.write(static_cast<std::uint32_t>(address), bytes, done) == Status::success;
    }
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        std::uint8_t* c = known(address + i) ? cell(address + i, true) : nullptr;
        if (c == nullptr) return false;
        *c = bytes[i];
    }
    return true;
}

bool UserXml::applies(const Target& t) {
    std::string chosen;
    return t.selector.empty() || !engine_->get(t.selector, chosen) || chosen == t.selected;
}

bool UserXml::value_of(const Target& t, std::uint32_t& word) {
    if (!t.entries.empty()) {
        std::string name;
        if (!engine_->get(t.name, name)) return false;
        const auto at = std::find_if(t.entries.begin(), t.entries.end(),
                                     [&](const FeatureEntry& e) { return e.name == name; });
        word = at == t.entries.end() ? unknown_choice : at->value;
        return true;
    }
    const Feature& f = *t.feature;
    double value = 0;
    if (!engine_->get(t.name, value)) return false;
    value = std::round(value * f.scale);
    const double low = f.is_signed ? INT32_MIN : 0, high = f.is_signed ? INT32_MAX : UINT32_MAX;
    // Clamp to a word that the native register refuses, too.
    if (value < low || value > high) value = f.is_signed ? low : high;
    word = f.is_signed ? static_cast<std::uint32_t>(static_cast<std::int32_t>(value))
                       : static_cast<std::uint32_t>(value);
    return true;
}

bool UserXml::show(Binding& b) {
    const Target& t = *b.target;
    const Feature& f = *t.feature;
    if (t.kind == Target::Kind::text) return engine_->set(t.name, native_.text(f.address));
    if (!applies(t)) return true;
    std::uint32_t word = 0, shows = 0;
    if (native_.read_word(f.address, word) != Status::success) return false;
    if (value_of(t, shows) && shows == word) {
        b.last = word;
        return true;
    }
    bool taken = false;
    if (!t.entries.empty()) {
        // Where the value has several names the first one in the file counts.
        for (const FeatureEntry& e : t.entries)
            if (e.value == word && !taken) taken = engine_->set(t.name, std::string(e.name));
    } else {
        const double value = f.is_signed ? static_cast<double>(static_cast<std::int32_t>(word)) : word;
        taken = engine_->set(t.name, value / f.scale);
    }
    b.last = word;
    return taken;
}

void UserXml::show_all() {
    for (Binding& b : bindings_)
        if (b.target->kind != Target::Kind::text) show(b);
}

Status UserXml::take_changes() {
    for (Binding& b : bindings_) {
        std::uint32_t word = 0;
        if (b.target->kind != Target::Kind::setting || !applies(*b.target) || !value_of(*b.target, word) ||
            word == b.last)
            continue;
        std::uint32_t now = 0;
        native_.read_word(b.target->feature->address, now);
        if (word != now)
            if (const Status status = native_.write_word(b.target->feature->address, word);
                status != Status::success)
                return status;
        b.last = word;
    }
    return Status::success;
}

bool UserXml::record_command(Binding& b) {
    std::vector<Recorded> first, second;
    for (auto [fill, into] : {std::pair{std::uint8_t{0}, &first}, std::pair{std::uint8_t{0xFF}, &second}}) {
        fill_ = fill;
        recording_ = into;
        engine_->execute(b.target->name);
        recording_ = nullptr;
    }
    if (first.size() != 1 || second.size() != 1 || first[0].address != second[0].address ||
        first[0].bytes.size() != second[0].bytes.size() || first[0].bytes.empty())
        return false;
    b.address = first[0].address;
    b.bytes = first[0].bytes;
    // Bits that do not depend on the previous contents belong to the command.
    for (std::size_t i = 0; i < b.bytes.size(); ++i)
        b.mask.push_back(static_cast<std::uint8_t>(~(first[0].bytes[i] ^ second[0].bytes[i])));
    return true;
}

void UserXml::record_value(Binding& b) {
    noting_loads_ = &b.touched;
    std::uint32_t word = 0;
    std::string name;
    if (!value_of(*b.target, word)) engine_->get(b.target->name, name);
    noting_loads_ = nullptr;
}

void UserXml::bind() {
    using Kind = GenicamEngine::Kind;
    std::string driven, absent, odd;
    const auto list = [](std::string& to, const std::string& what) { to += (to.empty() ? "" : ", ") + what; };
    // Select the bound item of each selector.
    for (const Target& t : targets_)
        if (!t.selector.empty()) engine_->set(t.selector, t.selected);
    for (const Target& t : targets_) {
        const Kind kind = engine_->kind(t.name);
        const bool fits = t.kind == Target::Kind::command ? kind == Kind::command
                          : t.kind == Target::Kind::text  ? kind == Kind::text
                          : !t.entries.empty()            ? kind == Kind::choice
                                                          : kind == Kind::number || kind == Kind::flag;
        if (!fits) {
            list(kind == Kind::absent ? absent : odd,
                 kind == Kind::absent ? t.name : fmt::format("{} (of another type)", t.name));
            continue;
        }
        Binding b;
        b.target = &t;
        if (t.kind == Target::Kind::command) {
            if (record_command(b)) {
                commands_.push_back(std::move(b));
                list(driven, t.name);
            } else {
                list(odd, fmt::format("{} (writes no register)", t.name));
            }
            continue;
        }
        show(b);
        if (t.kind != Target::Kind::text) {
            std::uint32_t shows = 0, is = 0;
            native_.read_word(t.feature->address, is);
            if (applies(t) && (!value_of(t, shows) || shows != is)) {
                // The file cannot represent the camera's value: set the camera to the file's value if
                // possible.
                const bool good = t.kind == Target::Kind::setting && shows != unknown_choice &&
                                  native_.write_word(t.feature->address, shows) == Status::success;
                if (!good) {
                    list(odd, fmt::format("{} (the file's value is not the camera's)", t.name));
                    continue;
                }
                b.last = shows;
            }
        }
        record_value(b);
        bindings_.push_back(std::move(b));
        list(driven, t.name);
    }
    show_all();
    report_ = fmt::format("{}: {} registers; driven: {}; not in the file: {}{}{}", name_, ranges_.size(),
                          driven.empty() ? "nothing" : driven, absent.empty() ? "nothing" : absent,
                          odd.empty() ? "" : "; not driven: ", odd);
}

void UserXml::preset(const std::string& file, const std::string& values) {
    for (const XmlPreset& preset : xml_presets_of(values)) {
        if (!preset.has_value || !engine_->set(preset.name, preset.value)) {
            const std::string_view why = !preset.has_value ? "no ="
                                         : engine_->kind(preset.name) == GenicamEngine::Kind::absent
                                             ? "no such feature"
                                             : "cannot be set so";
            throw RefusedPreset(explain_bad_preset(preset, why, file));
        }
        if (take_changes() != Status::success)
            throw RefusedPreset(fmt::format("\"{}\": outside what the camera allows", preset.item));
    }
    show_all();
}

Status UserXml::read(std::uint32_t address, std::span<std::uint8_t> out) {
    if (address % 4 != 0) return Status::bad_alignment;
    if (out.size() % 4 != 0) return Status::invalid_parameter;
    for (Binding& b : bindings_)
        if ((b.target->kind == Target::Kind::shown || b.target->feature->foreign.moves) &&
            std::any_of(b.touched.begin(), b.touched.end(), [&](const auto& r) {
                return overlap(address, std::uint64_t{address} + out.size(), r.begin, r.end);
            }))
            show(b);
    for (std::size_t done = 0; done < out.size(); done += 4) {
        const std::uint64_t at = std::uint64_t{address} + done;
        const auto word = out.subspan(done, 4);
        if (at > UINT32_MAX) return Status::invalid_address;
        if (at >= xml_address_ && at < xml_address_ + xml_.size()) {
            std::fill(word.begin(), word.end(), std::uint8_t{0});
            const std::size_t from = at - xml_address_;
            std::memcpy(word.data(), xml_.data() + from, std::min<std::size_t>(4, xml_.size() - from));
        } else if (at < manufacturer_begin && native_.find(static_cast<std::uint32_t>(at)) != nullptr) {
            if (const Status status = native_.read(static_cast<std::uint32_t>(at), word);
                status != Status::success)
                return status;
        } else {
            if (!known(at)) return Status::invalid_address;
            for (std::size_t i = 0; i < 4; ++i)
                word[i] = peek(at + i);
        }
    }
    return Status::success;
}

bool UserXml::given(const Binding& command) const {
    for (std::size_t i = 0; i < command.bytes.size(); ++i)
        if (((peek(command.address + i) ^ command.bytes[i]) & command.mask[i]) != 0) return false;
    return true;
}

Status UserXml::run_commands(std::uint64_t address, std::size_t bytes) {
    // Several commands may share a register: compare all with the value written before any clears it, as the
    // value of one can be 0. Two names of a feature with one value are one command.
    std::vector<const Binding*> start;
    for (const Binding& b : commands_)
        if (overlap(address, address + bytes, b.address, b.address + b.bytes.size()) && given(b) &&
            std::none_of(start.begin(), start.end(),
                         [&](const Binding* s) { return s->target->feature == b.target->feature; }))
            start.push_back(&b);
    // Commands complete at once: clear their bits in the register.
    for (const Binding* b : start)
        for (std::size_t i = 0; i < b->bytes.size(); ++i)
            if (std::uint8_t* c = cell(b->address + i, true))
                *c = static_cast<std::uint8_t>(*c & ~b->mask[i]);
    for (const Binding* b : start) {
        const Status status = native_.write_word(b->target->feature->address, 1);
        show_all();
        if (status != Status::success) return status;
    }
    return Status::success;
}

Status UserXml::write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done) {
    done = 0;
    if (address % 4 != 0) return Status::bad_alignment;
    if (bytes.size() % 4 != 0) return Status::invalid_parameter;
    // Split into ranges that are either bootstrap registers or memory.
    const auto is_native = [this](std::uint64_t at) {
        return at < manufacturer_begin && native_.find(static_cast<std::uint32_t>(at)) != nullptr;
    };
    while (done < bytes.size()) {
        const std::uint64_t at = std::uint64_t{address} + done;
        if (at > UINT32_MAX) return Status::invalid_address;
        const bool native = is_native(at);
        std::size_t n = 4;
        while (done + n < bytes.size() && is_native(at + n) == native)
            n += 4;
        const auto part = bytes.subspan(done, n);
        if (native) {
            std::size_t written = 0;
            const Status status = native_.write(static_cast<std::uint32_t>(at), part, written);
            done += written;
            if (status != Status::success) return status;
            show_all(); // the register may belong to a bound feature or change another, like PayloadSize
            continue;
        }
        if (at >= xml_address_ && at < xml_address_ + xml_.size()) return Status::write_protect;
        if (at + n > std::uint64_t{UINT32_MAX} + 1) return Status::invalid_address;
        for (std::size_t i = 0; i < n; ++i)
            if (!known(at + i)) return Status::invalid_address;
        if (!may_write(at, n)) return Status::write_protect;
        std::vector<std::uint8_t> before(n);
        for (std::size_t i = 0; i < n; ++i)
            before[i] = peek(at + i);
        if (!store(at, part)) return Status::error;
        Status status = take_changes();
        if (status == Status::success) {
            status = run_commands(at, n);
            if (status != Status::success) return status;
        } else {
            store(at, before);
            take_changes();
            show_all();
            return status;
        }
        show_all();
        done += n;
    }
    return Status::success;
}

} // namespace obscura::transports::gige
