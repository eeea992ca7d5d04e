// SPDX-License-Identifier: Apache-2.0
// Section of a configuration: its keys, tables and rules, for reading, checking, printing and the reference.
// Read this header first.
#pragma once

#include "config/keys.hpp"

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::config {

/// A table after its keys were read, for the checks of its owner.
class ReadTable {
public:
    /// `table` is null when the file does not have it; `at` is the position of its name. `table` and
    /// `mistakes` outlive this.
    ReadTable(const Value* table, Position at, Where where, Given given, Mistakes& mistakes)
        : table_(table), at_(at), where_(std::move(where)), given_(std::move(given)), mistakes_(mistakes) {}

    /// Whether the file gives `key`, rather than leaving the default.
    [[nodiscard]] bool has(std::string_view key) const { return given_.find(key) != given_.end(); }
    /// Reports a mistake in the value of `key` at the position of the key, or of the table if the file does
    /// not give the key.
    void refuse(std::string_view key, std::string_view what) const;
    /// Reports a mistake of the table as a whole.
    void refuse_table(std::string_view what) const;
    /// Runs `check` and reports the ConfigError or std::invalid_argument that it throws as a mistake in
    /// `key`.
    void refuse_if_thrown(std::string_view key, const std::function<void()>& check) const;
    /// "file:line:column" of the table; the file alone if it does not have the table.
    [[nodiscard]] std::string position_text() const;

    [[nodiscard]] const Value* table() const noexcept { return table_; }
    [[nodiscard]] Position at() const noexcept { return at_; }
    [[nodiscard]] const Where& where() const noexcept { return where_; }
    [[nodiscard]] const Given& given() const noexcept { return given_; }
    [[nodiscard]] Mistakes& mistakes() const noexcept { return mistakes_; }

private:
    [[nodiscard]] Position position_of(std::string_view key) const;

    const Value* table_;
    Position at_;
    Where where_;
    Given given_;
    Mistakes& mistakes_;
};

/// The member table `name` of `parent`, for checks after its keys were read; `where` is the parent's. has()
/// is false for all keys. `parent` and `mistakes` outlive it.
[[nodiscard]] ReadTable table_for_checks(const Value& parent, const Where& where, std::string_view name,
                                         Mistakes& mistakes);

struct Section;

/// An array of tables [[name]], bound to the container that its elements are read into.
struct List {
    std::string_view name;
    std::string_view help;
    std::function<void()> clear;
    /// Appends an element with its defaults, to be read from `table`, and returns its section; that is valid
    /// until the next append().
    std::function<Section(const Value& table)> append;
    std::function<std::size_t()> size;
    std::function<Section(std::size_t index)> at;
    /// Sections of elements with their defaults, for the reference: one, or one for each kind of element.
    std::function<std::vector<Section>()> examples;
    /// Numbers of elements that are allowed if the file gives the array.
    std::size_t least = 0, most = std::numeric_limits<std::size_t>::max();
};

/// A table of a configuration, bound to the struct that it is read into: its keys, the tables within it, and
/// the checks of its owner. The struct holds the defaults and outlives the section.
struct Section {
    std::string_view name; ///< last part of the dotted path; empty for the root of a file
    std::string_view help; ///< one or two sentences for the reference
    Keys keys{};
    std::vector<Section> tables{};
    std::vector<List> lists{};
    /// Called before the keys are read, if the file has the table: reads another file whose values the keys
    /// of this table override.
    std::function<void(const Value& table, const Where& where, Mistakes& mistakes)> before{};
    /// Checks rules between keys and converts the values read. Opens nothing but files. Called if all keys of
    /// the table itself could be read, also if the file does not have the table.
    std::function<void(const ReadTable& table)> check{};
    /// Names of members that another section or the caller reads.
    std::vector<std::string_view> elsewhere{};
    bool annotated = false; ///< values may stand with their provenance, see read_keys()
    /// Part of an effective configuration; false: printed as a commented-out example, and a root not at all.
    bool printed = true;
    bool optional = false;      ///< keys are required only if the file has the table
    std::string_view variant{}; ///< in a list's example: the elements that have these keys
};

/// A list that is a vector, with one section for each element.
template<typename Element>
[[nodiscard]] List list(std::string_view name, std::string_view help, std::vector<Element>& elements,
                        Section (*section)(Element&)) {
    List made;
    made.name = name;
    made.help = help;
    made.clear = [&elements] { elements.clear(); };
    made.append = [&elements, section](const Value& /*table*/) { return section(elements.emplace_back()); };
    made.size = [&elements] { return elements.size(); };
    made.at = [&elements, section](std::size_t index) { return section(elements.at(index)); };
    made.examples = [section] {
        static Element fresh{};
        return std::vector{section(fresh)};
    };
    return made;
}

/// Reads `table`, which may be null, into the struct that `section` is bound to. `where` is the table's own,
/// `at` the position of its name in the file, where mistakes of the table as a whole are reported.
void read_section(const Value* table, Position at, const Where& where, const Section& section,
                  Mistakes& mistakes);

/// Reads the member of `parent` that has the section's name; `where` is the parent's.
void read_member(const Value& parent, const Where& where, const Section& section, Mistakes& mistakes);

/// The section as TOML with every key, its unit, range and help as comments. Empty lists and tables within
/// that are not printed appear as commented-out examples. `prefix` is the dotted path of the tables around
/// the section, with a full stop at its end, or empty.
[[nodiscard]] std::string print_section(const Section& section, std::string_view prefix);

/// One table for the reference.
struct DocumentedTable {
    std::string heading; ///< "[gige]", "[[gige.faults]]"
    std::string variant; ///< Section::variant
    std::string help;
    Keys keys;
    std::shared_ptr<const void> bound; ///< owner of the structs that the keys are bound to
};
/// `section` and all tables within, with their defaults as values. The keys are bound to the same struct as
/// those of the section.
[[nodiscard]] std::vector<DocumentedTable> document(const Section& section, std::string_view prefix);

/// Whether the dotted path, without indices of lists, names a key of the section that a reload accepts.
[[nodiscard]] bool is_reloadable(const Section& section, std::string_view path);

} // namespace obscura::config
