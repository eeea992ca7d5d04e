// SPDX-License-Identifier: Apache-2.0
// One row of the GenICam feature table: SFNC name, register, unit, range, getter and setter.
#pragma once

#include "core/camera/setting.hpp"
#include "transports/gige/registers/register_bank.hpp"
#include "transports/gige/wire/chunk.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace obscura::transports::gige {

struct DeviceContext; ///< device/device_context.hpp
struct Feature;

/// The current word (two words: 64 bits) of register `index` of its selector. Control thread.
using GetFeature = std::uint64_t (*)(const Feature& feature, DeviceContext& device, std::uint32_t index);
/// Checks and applies a word that lies in the row's range; nothing changes on refusal. Control thread.
using SetFeature = Status (*)(const Feature& feature, DeviceContext& device, std::uint32_t index,
                              std::uint32_t word);

/// One item of an enumeration.
struct FeatureEntry {
    std::string_view name;
    std::uint32_t value = 0;
    std::string_view available = {}; ///< formula: nonzero if clients may select it
    std::string_view tooltip = {};
    bool custom = false; ///< not a name of SFNC
};

/// A limit or increment of a feature, in the feature's unit.
struct FeatureBound {
    std::optional<double> fixed = {};
    std::string_view held_by = {}; ///< the feature or formula that holds it
    std::uint32_t address = 0;     ///< a register of its own, read-only, scaled as the feature's
    GetFeature get = nullptr;      ///< of that register; null: that of the row's setting
    bool cached = true;            ///< that register never changes

    [[nodiscard]] constexpr bool given() const {
        return fixed.has_value() || !held_by.empty() || address != 0;
    }
};
constexpr FeatureBound fixed(double value) {
    return {.fixed = value};
}
constexpr FeatureBound held_by(std::string_view name) {
    return {.held_by = name};
}
constexpr FeatureBound in_register(std::uint32_t address, GetFeature get = nullptr) {
    return {.address = address, .get = get};
}
/// As in_register(), for a limit that depends on other settings.
constexpr FeatureBound in_changing_register(std::uint32_t address, GetFeature get) {
    return {.address = address, .get = get, .cached = false};
}

/// A variable of a formula and the feature whose raw value it stands for.
struct FormulaVariable {
    std::string_view symbol, feature;
};

/// Bits of a register in GigE Vision's numbering: 0 is the most significant one.
struct RegisterBits {
    int lsb = -1, msb = -1;
    [[nodiscard]] constexpr bool given() const { return lsb >= 0; }
};
constexpr RegisterBits register_bit(int n) {
    return {n, n};
}

/// How a feature is bound to a user-supplied GenICam file, see genicam/user_xml.hpp.
struct ForeignBinding {
    bool bound = false;
    std::array<std::string_view, 1> other_names = {}; ///< beside the SFNC name
    std::span<const FeatureEntry> entries = {};       ///< in place of the feature's own
    bool moves = false;                               ///< the camera changes the value without a write
    /// Features of a lower rank are shown first: others depend on them.
    int rank = 0;
};

/// IInteger, IFloat, ... of GenApi. `formula` is an integer computed from other features.
enum class FeatureType : std::uint8_t { integer, floating, enumeration, boolean, command, string, formula };

enum class Visibility : std::uint8_t { beginner, expert, guru, invisible };

/// Whether writes are refused (WRITE_PROTECT) during acquisition, and whether the description says so
/// (pIsLocked).
enum class FeatureLock : std::uint8_t {
    none,
    streaming,
    streaming_but_first, ///< writable for the first item of the selector
    streaming_unmarked,  ///< refused, but not marked in the description
};

/// Complete definition of one feature. camera.xml, the registers, the binding of user-supplied GenICam files
/// and docs/reference/features.md are made from the rows. Static storage.
///
/// Registers from `manufacturer_begin` on are added to the RegisterBank from the row; those below are the
/// bootstrap registers, which the row only describes. A writable register without getter and setter stores
/// what is written.
struct Feature {
    std::string_view name; ///< of SFNC, or of an unlisted helper
    /// Row of the setting table that this one is completed from, see of_setting().
    const Setting* setting = nullptr;
    FeatureType type = FeatureType::integer;
    bool custom = false; ///< not in SFNC
    bool listed = true;  ///< false: a register or formula that other rows refer to
    Visibility visibility = Visibility::beginner;
    std::string_view tooltip = {};
    Access access = Access::read_write; ///< ignored by commands, which are write-only

    // Register.
    std::uint32_t address = 0;
    bool bootstrap_zero = false; ///< `address` 0 is valid: the Version register
    std::uint32_t bytes = 4;     ///< 8: unsigned or signed 64 bits; strings: length of the field
    RegisterBits bits = {};
    std::optional<Chunk> chunk = {}; ///< `address` counts from the beginning of this chunk's data
    bool cached = false;             ///< changes only when a client writes it
    /// Feature or formula whose value is shown; empty: the register's.
    std::string_view value_of = {};
    std::array<std::string_view, 2> selectors = {};
    /// Bytes between the registers of successive items of the first selector; 0: one register for all.
    std::uint32_t stride = 0;

    // Value.
    std::string_view unit = {};
    double scale = 1; ///< words per unit; floating only
    bool is_signed = false;
    std::string_view representation = {}; ///< of GenApi, e.g. IPV4Address
    FeatureBound minimum = {}, maximum = {}, increment = {};
    std::span<const FeatureEntry> entries = {};
    /// Entries below the value of this feature are available.
    std::string_view entries_below = {};
    std::uint32_t constant = 0; ///< value without register; of selectors the first value
    std::uint32_t command_value = 1;
    std::string_view formula = {};
    std::array<FormulaVariable, 3> variables = {};

    // Conditions of writing.
    std::string_view available = {}; ///< formula
    FeatureLock lock = FeatureLock::none;
    std::string_view locked_by = {}; ///< formula in place of TLParamsLocked
    bool in_user_set = true;         ///< saved if it can be written

    // Access and effects.
    GetFeature get = nullptr;
    SetFeature set = nullptr;
    GetFeature kept = nullptr; ///< the word that user sets hold, where it is not the one that clients read
    Status (*run)(DeviceContext& device, std::uint32_t index) = nullptr;   ///< commands
    void (*written)(DeviceContext& device, std::uint32_t index) = nullptr; ///< after a stored word changed
    std::uint32_t (*reset)(const DeviceContext& device) = nullptr;         ///< of stored words; null: 0
    std::string (*text)(const DeviceContext& device) = nullptr;            ///< strings; constant

    ForeignBinding foreign = {};

    [[nodiscard]] constexpr bool has_register() const {
        return (address != 0 || bootstrap_zero) && value_of.empty() && !chunk;
    }
};

/// A GenICam category and its features in the order in which clients list them.
struct FeatureCategory {
    std::string_view name;
    std::span<const Feature> features = {};
    std::string_view parent = "Root";
    bool custom = false;
};

/// First address that the standard leaves to the manufacturer.
constexpr std::uint32_t manufacturer_begin = 0xA000;
/// Address of the zipped camera.xml.
constexpr std::uint32_t xml_file_address = 0x0010'0000;

/// A register that holds a limit is named after the feature: WidthMin, WidthMax, WidthStep.
constexpr std::string_view minimum_suffix = "Min", maximum_suffix = "Max", increment_suffix = "Step";

/// Null when there is no such row.
[[nodiscard]] const Feature* find_feature(std::span<const FeatureCategory> table, std::string_view name);
/// Number of items of a selector: entries, or values from 0 to the maximum.
[[nodiscard]] std::uint32_t item_count(const Feature& selector);
/// Whether `word` is in the fixed range of `feature` or one of its entries.
[[nodiscard]] bool in_range(const Feature& feature, std::uint32_t word);
/// Limits of the fixed range as words; 0 and the largest word where there is none.
[[nodiscard]] std::uint32_t smallest_word(const Feature& feature);
[[nodiscard]] std::uint32_t largest_word(const Feature& feature);
/// A quantity in the feature's unit as the word of its register, and back.
[[nodiscard]] std::uint32_t to_word(const Feature& feature, double value);
[[nodiscard]] double from_word(const Feature& feature, std::uint32_t word);
/// A duration as the word of its register, and back (unit us, scale words per us); clamped to 32 bits.
[[nodiscard]] std::uint32_t duration_to_word(const Feature& feature, std::int64_t ns);
[[nodiscard]] std::int64_t duration_from_word(const Feature& feature, std::uint32_t word);

} // namespace obscura::transports::gige
