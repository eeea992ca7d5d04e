// SPDX-License-Identifier: Apache-2.0
// The description of a real camera in place of ours: its registers as memory, its SFNC features bound to
// ours.
#pragma once

#include "transports/gige/genicam/genicam_engine.hpp"
#include "transports/gige/registers/feature.hpp"
#include "transports/gige/registers/register_bank.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports::gige {

/// The text of a GenICam file. Throws ConfigError: not readable, or larger than any such file.
[[nodiscard]] std::string read_xml_file(const std::string& file);
/// Why the file is no description that could be bound; empty when it is one. Names no key.
[[nodiscard]] std::string explain_invalid_xml(const std::string& file);
/// Why `values` are no "Feature=value, ..." of features in the good description `file`; empty when they are.
/// Whether the features take these values is seen by UserXml only. Names no key.
[[nodiscard]] std::string explain_invalid_values(const std::string& file, const std::string& values);

/// What clients see of a camera whose GenICam file is somebody else's. Bootstrap registers are those of
/// `native`; every other register that the file names is memory. When a client has written there, each
/// feature that is bound by its SFNC name is evaluated; where its value has changed, the register of `native`
/// that is behind our own description gets it, and when that refuses, the write is refused and undone.
/// Control thread only.
class UserXml final : private GenicamEngine::Memory {
public:
    /// `file` is for messages and for the name that clients see. `values` is "Feature=value, ...": what
    /// registers hold after reset beyond the camera's own settings. `native` must outlive this and is
    /// complete but for registers that are never bound. What is bound is `table`'s ForeignBindings. Throws
    /// ConfigError.
    UserXml(const std::string& file, std::string xml, const std::string& values, RegisterBank& native,
            std::span<const FeatureCategory> table);

    /// As those of RegisterBank.
    Status read(std::uint32_t address, std::span<std::uint8_t> out);
    Status write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done);

    /// For the bootstrap register.
    [[nodiscard]] std::string url() const;
    /// Which features are driven and which are not there, in one line.
    [[nodiscard]] const std::string& report() const noexcept { return report_; }

private:
    /// A feature under one of the names that cameras know it by.
    struct Target {
        enum class Kind : std::uint8_t { setting, shown, command, text };
        std::string name;
        const Feature* feature = nullptr;
        Kind kind = Kind::setting;
        std::span<const FeatureEntry> entries = {}; ///< of a choice
        /// Only the item of a selector that is ours is bound.
        std::string selector = {}, selected = {};
    };
    struct Binding {
        const Target* target = nullptr;
        std::uint32_t last = 0; ///< native word that the file's value stands for
        // Where the feature's value lies, as far as it was seen.
        std::vector<GenicamEngine::RegisterRange> touched;
        // Commands: the bytes that they write, and which of their bits.
        std::uint64_t address = 0;
        std::vector<std::uint8_t> bytes, mask;
    };
    /// Stores that GenICam makes while we want to know where.
    struct Recorded {
        std::uint64_t address;
        std::vector<std::uint8_t> bytes;
    };

    bool load(std::uint64_t address, std::span<std::uint8_t> out) override;
    bool store(std::uint64_t address, std::span<const std::uint8_t> bytes) override;

    [[nodiscard]] static std::vector<Target> make_targets(std::span<const FeatureCategory> table);
    void map_registers();
    void bind();
    void preset(const std::string& file, const std::string& values);
    bool record_command(Binding& binding);
    void record_value(Binding& binding);
    [[nodiscard]] bool applies(const Target& target);
    bool value_of(const Target& target, std::uint32_t& word);
    bool show(Binding& binding);
    void show_all();
    Status take_changes();
    Status run_commands(std::uint64_t address, std::size_t bytes);

    [[nodiscard]] bool known(std::uint64_t address) const;
    [[nodiscard]] bool may_write(std::uint64_t address, std::size_t bytes) const;
    [[nodiscard]] std::uint8_t* cell(std::uint64_t address, bool create);
    [[nodiscard]] std::uint8_t peek(std::uint64_t address) const;

    static constexpr std::uint64_t page_bytes = 4096;
    using Page = std::array<std::uint8_t, page_bytes>;

    const std::string name_, xml_;
    RegisterBank& native_;
    const std::vector<Target> targets_; ///< in the order in which the file is made to show them
    std::uint64_t xml_address_ = 0;
    std::map<std::uint64_t, Page> pages_;              // touched so far
    std::map<std::uint64_t, bool> known_pages_;        // page number; value unused
    std::vector<GenicamEngine::RegisterRange> ranges_; // sorted by begin
    std::uint64_t longest_range_ = 0;
    std::vector<Recorded>* recording_ = nullptr;
    std::vector<GenicamEngine::RegisterRange>* noting_loads_ = nullptr;
    std::uint8_t fill_ = 0; // what loads give while recording
    std::unique_ptr<GenicamEngine> engine_;
    std::vector<Binding> bindings_, commands_;
    std::string report_;
};

} // namespace obscura::transports::gige
