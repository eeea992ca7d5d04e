// SPDX-License-Identifier: Apache-2.0
#include "models/language/findings.hpp"

#include "core/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::models {

void Findings::add(Finding finding) {
    const auto same = [&](const Finding& f) { return f.at == finding.at && f.what == finding.what; };
    if (std::any_of(findings_.begin(), findings_.end(), same)) return;
    if (finding.error && ++errors_ > max_findings) return;
    if (!finding.error && findings_.size() >= 2 * max_findings) return;
    findings_.push_back(std::move(finding));
}

std::vector<Finding> Findings::sorted() const {
    std::vector<Finding> all = findings_;
    std::stable_sort(all.begin(), all.end(), [](const Finding& a, const Finding& b) { return a.at < b.at; });
    return all;
}

std::string Findings::text(std::string_view file, bool errors) const {
    std::string text;
    for (const Finding& f : sorted())
        if (f.error == errors)
            text +=
                fmt::format("{}{}:{}:{}: {}", text.empty() ? "" : "\n", file, f.at.line, f.at.column, f.what);
    if (errors && errors_ > max_findings)
        text += fmt::format("\n{}: {} more errors", file, errors_ - max_findings);
    return text;
}

} // namespace obscura::models
