// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/fault_rules.hpp"

#include <memory>

namespace obscura::transports::gige {
namespace {

FaultRules::Row row_of(const FaultRule& rule) {
    const auto own = std::make_shared<FaultRule>(rule);
    return {own, section_of(*own)};
}

} // namespace

std::vector<FaultRules::Kind> GigeFaultRules::kinds() const {
    std::vector<Kind> kinds;
    for (const auto& [fault, name] : enum_names(Fault{}))
        kinds.push_back({name, help_of(fault)});
    return kinds;
}

FaultRules::Row GigeFaultRules::blank() const {
    return row_of({});
}

std::vector<FaultRules::Row> GigeFaultRules::armed() const {
    std::vector<Row> rows;
    for (const ArmedFault& one : device_.armed_faults().all()) {
        rows.push_back(row_of(one.rule));
        rows.back().origin = name_of(one.origin);
        rows.back().struck = one.struck();
    }
    return rows;
}

void GigeFaultRules::arm(const std::vector<Row>& rows) {
    std::vector<FaultRule> rules;
    for (const Row& row : rows)
        rules.push_back(*std::static_pointer_cast<FaultRule>(row.rule));
    device_.arm_faults(rules);
}

} // namespace obscura::transports::gige
