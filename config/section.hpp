// SPDX-License-Identifier: Apache-2.0
// Read this first: a section of a configuration, from which reading, checks, printing and the reference are
// made.
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
    /// `table` is null when the file does not have it; `at` is the place of its name. The references outlive
    /// this.
    ReadTable(const Value* table, Position at, const Where& where, Given given, Mistakes& mistakes)
        : table_(table), at_(at), where_(where), given_(std::move(given)), mistakes_(mistakes) {}

    /// Whether the file gives `key`, rather than leaving the default.
    [[nodiscard]] bool has(std::string_view key) const { return given_.find(key) != given_.end(); }
    /// A mistake in the value of `key`: named with the key's place, or the table's where it is not given.
    void refuse(std::string_view key, std::string_view what) const;
    /// A mistake of the table as a whole.
    void refuse_table(std::string_view what) const;
    /// Runs `check`; what it complains of by a ConfigError or std::invalid_argument is a mistake in `key`.
    void refuse_if_thrown(std::string_view key, const std::function<void()>& check) const;

    [[nodiscard]] const Value* table() const noexcept { return table_; }
    [[nodiscard]] const Where& where() const noexcept { return where_; }
    [[nodiscard]] const Given& given() const noexcept { return given_; }
    [[nodiscard]] Mistakes& mistakes() const noexcept { return mistakes_; }

private:
    [[nodiscard]] Position position_of(std::string_view key) const;

    const Value* table_;
    Position at_;
    const Where& where_;
    Given given_;
    Mistakes& mistakes_;
};

struct Section;

/// An array of tables [[name]], bound to the container of what they are read into.
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
    std::size_t least = 0; ///< elements, where the array is given at all
    std::size_t most = std::numeric_limits<std::size_t>::max();
};

/// A table of a configuration, bound to the struct that it is read into: which keys there are, which tables
/// within, and what its owner checks. Its struct holds the defaults and outlives it.
struct Section {
    std::string_view name; ///< last part of the dotted path; empty for the root of a file
    std::string_view help; ///< what the table is about: one or two sentences, for the reference
    Keys keys{};
    std::vector<Section> tables{};
    std::vector<List> lists{};
    /// Called before the keys are read, with the table, if the file has it: for keys that name another file
    /// with the values that this one overrides.
    std::function<void(const Value& table, const Where& where, Mistakes& mistakes)> before{};
    /// Rules between keys, and conversions of what was read. Opens nothing but files. Called when all keys
    /// of the table itself could be read, also where the file does not have the table.
    std::function<void(const ReadTable& table)> check{};
    /// Names of tables within that are read separately.
    std::vector<std::string_view> elsewhere{};
    bool annotated = false;     ///< values may stand with their provenance, see read_keys()
    bool printed = true;        ///< is part of an effective configuration
    bool optional = false;      ///< keys are required only where the file has the table
    std::string_view variant{}; ///< of a list's example: which elements have these keys
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

/// Reads `table`, which may be null, into what `section` is bound to. `where` is the table's own, `at` the
/// place of its name in the file, where mistakes of the table as a whole are reported.
void read_section(const Value* table, Position at, const Where& where, const Section& section,
                  Mistakes& mistakes);

/// Reads the member of `parent` that has the section's name; `where` is the parent's.
void read_member(const Value& parent, const Where& where, const Section& section, Mistakes& mistakes);

/// The section as TOML with every key, its unit, range and help as comments; `prefix` is the dotted path of
/// the tables around it, with a full stop at its end, or empty.
[[nodiscard]] std::string print_section(const Section& section, std::string_view prefix);

/// One table for the reference.
struct DocumentedTable {
    std::string heading; ///< "[gige]", "[[gige.faults]]"
    std::string variant; ///< as of Section
    std::string help;
    Keys keys;
    std::shared_ptr<const void> bound; ///< sections that own what the keys are bound to
};
/// `section` and all tables within, with their defaults as values. The keys are bound as those of the
/// section.
[[nodiscard]] std::vector<DocumentedTable> document(const Section& section, std::string_view prefix);

/// Whether the dotted path names a key of the section that a reload takes on. Indices of lists are left out.
[[nodiscard]] bool is_reloadable(const Section& section, std::string_view path);

} // namespace obscura::config
