// SPDX-License-Identifier: Apache-2.0
// User-supplied GenICam description of a real camera: its registers as memory, its SFNC features bound to
// those of this camera.
#pragma once

#include "core/error.hpp"
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

/// The XML of a GenICam file, plain or zipped (contents_of_genicam_file()). Throws ConfigError.
[[nodiscard]] std::string read_xml_file(const std::string& file);
/// Reason why the file is not a GenICam description; empty when it is one. Names no key.
[[nodiscard]] std::string explain_invalid_xml(const std::string& file);
/// Reason why `values` is not a list "Feature=value, ..." of features in the valid description `file`; empty
/// when it is one. Only UserXml checks whether the features accept the values. Names no key.
[[nodiscard]] std::string explain_invalid_values(const std::string& file, const std::string& values);

/// A value of gige.xml_values that its feature does not take.
class RefusedPreset : public ConfigError {
public:
    /// `why_` names no key.
    explicit RefusedPreset(const std::string& why_) : ConfigError("gige.xml_values: " + why_), why(why_) {}
    const std::string why;
};

/// Address space that clients see with a user-supplied description. Bootstrap registers are those of
/// `native`; every other register that the file names is memory. After a client's write to memory each
/// feature bound by its SFNC name is evaluated; a changed value is written to the feature's register in
/// `native`, and when that refuses, the client's write is refused and undone. Thread-bound: control thread.
class UserXml final : private GenicamEngine::Memory {
public:
    /// `file` is for messages and for the name that clients see. `values`, "Feature=value, ...", gives values
    /// after reset of features besides the camera's own settings. `native` must outlive this and contain
    /// every register that can be bound. The ForeignBindings of `table` are bound. Throws RefusedPreset, or
    /// ConfigError for the file.
    UserXml(const std::string& file, std::string xml, const std::string& values, RegisterBank& native,
            std::span<const FeatureCategory> table);

    /// As those of RegisterBank.
    Status read(std::uint32_t address, std::span<std::uint8_t> out);
    Status write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done);

    /// Shows the present values of all bound features, after a change that no client made.
    void show_all();

    /// Contents of the bootstrap register XMLFirstURL.
    [[nodiscard]] std::string url() const;
    /// Bound, absent and unusable features, in one line.
    [[nodiscard]] const std::string& report() const noexcept { return report_; }

private:
    /// A feature under one of the names that cameras use for it.
    struct Target {
        enum class Kind : std::uint8_t { setting, shown, command, text };
        std::string name;
        const Feature* feature = nullptr;
        Kind kind = Kind::setting;
        std::span<const FeatureEntry> entries = {}; ///< of a choice
        /// Selector of the feature, and its item that is bound; empty: no selector.
        std::string selector = {}, selected = {};
    };
    struct Binding {
        const Target* target = nullptr;
        std::uint32_t last = 0; ///< native word that the file's value stands for
        // Registers read to evaluate the feature.
        std::vector<GenicamEngine::RegisterRange> touched;
        // Commands: the bytes that they write, and the mask of the bits that they determine.
        std::uint64_t address = 0;
        std::vector<std::uint8_t> bytes, mask;
    };
    /// A store by the engine while stores are recorded.
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
    Status take_changes();
    [[nodiscard]] bool given(const Binding& command) const;
    Status run_commands(std::uint64_t address, std::size_t bytes);

    [[nodiscard]] bool known(std::uint64_t address) const;
    [[nodiscard]] bool may_write(std::uint64_t address, std::size_t bytes) const;
    [[nodiscard]] std::uint8_t* cell(std::uint64_t address, bool create);
    [[nodiscard]] std::uint8_t peek(std::uint64_t address) const;

    static constexpr std::uint64_t page_bytes = 4096;
    using Page = std::array<std::uint8_t, page_bytes>;

    const std::string name_, xml_;
    RegisterBank& native_;
    const std::vector<Target> targets_; ///< in the order in which show() writes them
    std::uint64_t xml_address_ = 0;
    std::map<std::uint64_t, Page> pages_;              // written so far
    std::map<std::uint64_t, bool> known_pages_;        // page number; value unused
    std::vector<GenicamEngine::RegisterRange> ranges_; // sorted by begin
    std::uint64_t max_range_ = 0;
    std::vector<Recorded>* recording_ = nullptr;
    std::vector<GenicamEngine::RegisterRange>* noting_loads_ = nullptr;
    std::uint8_t fill_ = 0; // returned by loads while stores are recorded
    std::unique_ptr<GenicamEngine> engine_;
    std::vector<Binding> bindings_, commands_;
    std::string report_;
};

} // namespace obscura::transports::gige
