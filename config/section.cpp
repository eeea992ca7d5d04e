// SPDX-License-Identifier: Apache-2.0
#include "config/section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace obscura::config {

Position ReadTable::position_of(std::string_view key) const {
    if (const auto given = given_.find(key); given != given_.end()) return given->second;
    if (table_ == nullptr) return {};
    // A table or list within may be refused, too.
    const Member* member = table_->find(key);
    if (member == nullptr) return at_;
    const Value& value = member->value;
    const bool tables = value.kind == Value::Kind::table ||
                        (!value.items.empty() && value.items.front().kind == Value::Kind::table);
    return tables ? member->at : value.at; // a table's place is that of its name
}

void ReadTable::refuse(std::string_view key, std::string_view what) const {
    mistakes_.add(where_.in(key), position_of(key), what);
}

void ReadTable::refuse_table(std::string_view what) const {
    mistakes_.add(where_, at_, what);
}

std::string ReadTable::position_text() const {
    const std::string file = where_.file.string();
    return at_.line == 0 ? file : fmt::format("{}:{}:{}", file, at_.line, at_.column);
}

void ReadTable::refuse_if_thrown(std::string_view key, const std::function<void()>& check) const {
    try {
        check();
    } catch (const ConfigError& error) {
        refuse(key, error.what());
    } catch (const std::invalid_argument& error) {
        refuse(key, error.what());
    }
}

ReadTable table_for_checks(const Value& parent, const Where& where, std::string_view name,
                           Mistakes& mistakes) {
    const Member* member = parent.find(name);
    return {member == nullptr ? nullptr : &member->value,
            member == nullptr ? Position{} : member->at,
            where.in(name),
            {},
            mistakes};
}

namespace {

void read_list(const Member& member, const Where& where, const List& list, Mistakes& mistakes) {
    const std::vector<Value>* tables = nullptr;
    if (!mistakes.collect([&] { tables = &expect_tables(member, where); })) return;
    if (tables->size() < list.least) {
        mistakes.add(where, member.at,
                     list.least == 1
                         ? fmt::format("empty, at least one {} is wanted", list.name)
                         : fmt::format("{} of them, allowed {} and more", tables->size(), list.least));
        return;
    }
    if (tables->size() > list.most) {
        mistakes.add(where, member.at,
                     fmt::format("{} of them, allowed at most {}", tables->size(), list.most));
        return;
    }
    list.clear();
    for (std::size_t i = 0; i < tables->size(); ++i) {
        const Where here{where.file, fmt::format("{}[{}]", where.path, i)};
        mistakes.collect([&] {
            const Section element = list.append((*tables)[i]);
            read_section(&(*tables)[i], (*tables)[i].at, here, element, mistakes);
        });
    }
}

} // namespace

void read_section(const Value* table, Position at, const Where& where, const Section& section,
                  Mistakes& mistakes) {
    if (table != nullptr && !mistakes.collect([&] { (void)expect_table(*table, where); })) return;
    const std::size_t before = mistakes.count();
    static const Value nothing;
    const Value& members = table == nullptr ? nothing : *table;
    if (table != nullptr && section.before) section.before(members, where, mistakes);
    std::vector<std::string_view> within = section.elsewhere;
    for (const Section& inner : section.tables)
        within.push_back(inner.name);
    for (const List& list : section.lists)
        within.push_back(list.name);
    Given given;
    if (table != nullptr || !section.optional)
        given = read_keys(members, where, section.keys, mistakes, within, section.annotated);
    const bool own_keys_good = mistakes.count() == before;
    for (const Section& inner : section.tables)
        read_member(members, where, inner, mistakes);
    for (const List& list : section.lists)
        if (const Member* member = members.find(list.name))
            read_list(*member, where.in(list.name), list, mistakes);
    if (section.check && own_keys_good)
        mistakes.collect([&] { section.check(ReadTable(table, at, where, std::move(given), mistakes)); });
}

void read_member(const Value& parent, const Where& where, const Section& section, Mistakes& mistakes) {
    const Member* member = parent.find(section.name);
    if (member == nullptr)
        read_section(nullptr, {}, where.in(section.name), section, mistakes);
    else
        read_section(&member->value, member->at, where.in(section.name), section, mistakes);
}

namespace {

/// A table that the configuration does not have, as a block of comments: TOML with its defaults once "# " is
/// removed from its lines.
std::string print_example(const Section& section, std::string_view heading, std::string_view help) {
    const std::string text = fmt::format("{}\n{}", heading, print_keys(section.keys));
    std::string out = fmt::format("\n# Absent. {}\n", help);
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = text.find('\n', begin);
        out += fmt::format("# {}\n", std::string_view(text).substr(begin, end - begin));
        begin = end + 1;
    }
    return out;
}

bool same_keys(const Section& a, const Section& b) {
    return std::equal(a.keys.begin(), a.keys.end(), b.keys.begin(), b.keys.end(),
                      [](const Key& x, const Key& y) { return x.name == y.name; });
}

void print_inside(const Section& section, const std::string& path, std::string& out) {
    out += print_keys(section.keys);
    const std::string prefix = path.empty() ? path : path + ".";
    for (const List& list : section.lists) {
        const std::string heading = fmt::format("[[{}{}]]", prefix, list.name);
        for (std::size_t i = 0; i < list.size(); ++i) {
            out += fmt::format("\n{}\n", heading);
            print_inside(list.at(i), prefix + std::string(list.name), out);
        }
        if (list.size() != 0) continue;
        for (const Section& example : list.examples())
            out += print_example(example, heading, list.help.empty() ? example.help : list.help);
    }
    const Section* example = nullptr;
    for (const Section& inner : section.tables) {
        const std::string heading = fmt::format("[{}{}]", prefix, inner.name);
        if (inner.printed)
            out += print_section(inner, prefix);
        else if (example != nullptr && same_keys(*example, inner))
            out += fmt::format("\n# Absent; has the same keys: {}\n", heading);
        else
            out += print_example(*(example = &inner), heading, inner.help);
    }
}

/// `bound` holds the section, and with its checks what they share with the keys.
void document_inside(const Section& section, const std::string& path, std::string heading,
                     const std::shared_ptr<const void>& bound, std::vector<DocumentedTable>& tables) {
    tables.push_back(
        {std::move(heading), std::string(section.variant), std::string(section.help), section.keys, bound});
    const std::string prefix = path.empty() ? path : path + ".";
    for (const Section& inner : section.tables) {
        const std::string here = fmt::format("{}{}", prefix, inner.name);
        document_inside(inner, here, fmt::format("[{}]", here), bound, tables);
    }
    for (const List& list : section.lists) {
        const std::string here = fmt::format("{}{}", prefix, list.name);
        const std::size_t first = tables.size();
        const auto examples = std::make_shared<const std::vector<Section>>(list.examples());
        for (const Section& example : *examples)
            document_inside(example, here, fmt::format("[[{}]]", here), examples, tables);
        if (tables.size() > first && !list.help.empty()) tables[first].help = list.help;
    }
}

} // namespace

std::string print_section(const Section& section, std::string_view prefix) {
    if (!section.printed) return {};
    const std::string path = fmt::format("{}{}", prefix, section.name);
    std::string out = path.empty() ? "" : fmt::format("\n[{}]\n", path);
    print_inside(section, path, out);
    return out;
}

std::vector<DocumentedTable> document(const Section& section, std::string_view prefix) {
    std::vector<DocumentedTable> tables;
    const std::string path = fmt::format("{}{}", prefix, section.name);
    const auto bound = std::make_shared<const Section>(section);
    document_inside(*bound, path, path.empty() ? "" : fmt::format("[{}]", path), bound, tables);
    return tables;
}

bool is_reloadable(const Section& section, std::string_view path) {
    const std::size_t stop = path.find('.');
    const std::string_view first = path.substr(0, stop);
    if (stop == std::string_view::npos)
        return std::any_of(section.keys.begin(), section.keys.end(),
                           [&](const Key& key) { return key.name == first && key.is_reloadable(); });
    return std::any_of(section.tables.begin(), section.tables.end(), [&](const Section& inner) {
        return inner.name == first && is_reloadable(inner, path.substr(stop + 1));
    });
}

} // namespace obscura::config
