// SPDX-License-Identifier: Apache-2.0
// ChunkDataControl: features of the fields of a frame's record (core/camera/frame_record.hpp).
#include "core/camera/frame_record.hpp"
#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/region_entries.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace obscura::transports::gige {
namespace {

constexpr auto chunk_selector_entries = [] {
    std::array<FeatureEntry, chunk_count> entries{};
    for (std::size_t i = 0; i < chunk_count; ++i)
        entries[i] = entry(enum_names(Chunk{})[i].name, enum_names(Chunk{})[i].value);
    return entries;
}();

/// Place of a record in a chunk: that of its first item, if it is the item of a list.
struct RecordPlace {
    Chunk chunk = Chunk::timestamp;
    std::size_t begin = 0;
    std::string_view selector = {}; ///< of the list; empty: there is none
};

template<typename Owner>
Feature feature_of(const RecordField<Owner>& field, const RecordPlace& place) {
    Feature out{.name = field.feature,
                .custom = field.custom,
                .tooltip = field.help,
                .access = Access::read_only,
                .address = static_cast<std::uint32_t>(place.begin + field.offset),
                .bytes = static_cast<std::uint32_t>(bytes_of(field.form)),
                .chunk = place.chunk,
                .unit = field.unit};
    if (field.form == FieldForm::f64) out.type = FeatureType::floating;
    if (field.form == FieldForm::text) out.type = FeatureType::string;
    if (!place.selector.empty()) {
        out.selectors = {place.selector};
        out.stride = static_cast<std::uint32_t>(record_bytes<Owner>());
    }
    return out;
}

/// Appends the fields that have features.
template<typename Owner>
void append(std::vector<Feature>& all, const RecordPlace& place) {
    for (const RecordField<Owner>& field : record_fields<Owner>())
        if (!field.feature.empty()) all.push_back(feature_of(field, place));
}

/// A word in the head of a list.
Feature head_word(std::string_view name, Chunk chunk, std::uint32_t address = 0,
                  std::string_view tooltip = {}) {
    return {.name = name,
            .custom = true,
            .tooltip = tooltip,
            .access = Access::read_only,
            .address = address,
            .chunk = chunk};
}

/// Index into a list.
Feature list_selector(std::string_view name, double last) {
    return {.name = name, .custom = true, .minimum = fixed(0), .maximum = fixed(last)};
}

void append_regions(std::vector<Feature>& all) {
    all.push_back(head_word("ChunkRegionCount", Chunk::regions));
    all.push_back(list_selector("ChunkRegionIndex", max_windows - 1));
    all.push_back({.name = "ChunkRegionID",
                   .type = FeatureType::enumeration,
                   .tooltip = "The region that is the window ChunkRegionIndex of the image",
                   .access = Access::read_only,
                   .value_of = "ChunkRegionIDValue",
                   .selectors = {"ChunkRegionIndex"},
                   .entries = region_entries});
    all.push_back({.name = "ChunkRegionIDValue",
                   .access = Access::read_only,
                   .address = 0x4,
                   .chunk = Chunk::region_id,
                   .selectors = {"ChunkRegionIndex"},
                   .stride = 4});
    append<FrameWindow>(all, {Chunk::regions, list_head_bytes, "ChunkRegionIndex"});
}

/// The list of bodies stands between the fields before and after it.
void append_truth(std::vector<Feature>& all) {
    for (const RecordField<GroundTruth>& field : record_fields<GroundTruth>())
        if (field.offset < truth_bodies_offset) all.push_back(feature_of(field, {Chunk::ground_truth}));
    all.push_back(list_selector("ChunkBodySelector", max_truth_bodies - 1));
    append<BodyTruth>(all, {Chunk::ground_truth, truth_bodies_offset, "ChunkBodySelector"});
    for (const RecordField<GroundTruth>& field : record_fields<GroundTruth>())
        if (field.offset > truth_bodies_offset) all.push_back(feature_of(field, {Chunk::ground_truth}));
    append<BodyAge>(all, {Chunk::ground_truth, truth_ages_offset, "ChunkBodySelector"});
}

std::vector<Feature> features() {
    std::vector<Feature> all{
        {.name = "ChunkModeActive",
         .type = FeatureType::boolean,
         .address = 0xA300,
         .lock = FeatureLock::streaming},
        {.name = "ChunkSelector", .type = FeatureType::enumeration, .entries = chunk_selector_entries},
        {.name = "ChunkEnable",
         .type = FeatureType::boolean,
         .address = 0xA310,
         .selectors = {"ChunkSelector"},
         .stride = 4,
         .lock = FeatureLock::streaming}};
    for (const RecordField<FrameHead>& field : record_fields<FrameHead>())
        all.push_back(feature_of(field, {chunk_of(field)}));
    append_regions(all);
    all.push_back(head_word("ChunkRowCount", Chunk::row_times));
    all.push_back(list_selector("ChunkRowIndex", 65535));
    append<RowTime>(all, {Chunk::row_times, list_head_bytes, "ChunkRowIndex"});
    append_truth(all);
    all.push_back(head_word("ChunkTruthCount", Chunk::truth_table, 0,
                            "Entries of the truth table: where objects are in the pixels of the frame"));
    all.push_back(head_word("ChunkTruthLeftOut", Chunk::truth_table, 4,
                            "Further entries, for which the chunk had no room"));
    all.push_back(list_selector("ChunkTruthSelector", 4095));
    append<TruthEntry>(all, {Chunk::truth_table, list_head_bytes, "ChunkTruthSelector"});
    const auto quality = static_cast<std::ptrdiff_t>(all.size());
    append<FrameQuality>(all, {Chunk::frame_quality});
    std::sort(all.begin() + quality, all.end(),
              [](const Feature& a, const Feature& b) { return a.address < b.address; });
    return all;
}

} // namespace

FeatureCategory chunk_data_control() {
    static const std::vector<Feature> all = features();
    return {.name = "ChunkDataControl", .features = all};
}

} // namespace obscura::transports::gige
