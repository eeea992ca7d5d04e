// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/body_names.hpp"

#include "core/error.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <vector>

namespace obscura::ephemeris {
namespace {

struct Entry {
    int id;
    std::string_view name;
};

/// Where a body has several names the last is its own (NAIF Integer ID Codes, N0067).
constexpr std::array entries{
    Entry{0, "SSB"},
    Entry{0, "SOLAR_SYSTEM_BARYCENTER"},
    Entry{0, "SOLAR SYSTEM BARYCENTER"},
    Entry{1, "MERCURY_BARYCENTER"},
    Entry{1, "MERCURY BARYCENTER"},
    Entry{2, "VENUS_BARYCENTER"},
    Entry{2, "VENUS BARYCENTER"},
    Entry{3, "EARTH_BARYCENTER"},
    Entry{3, "EMB"},
    Entry{3, "EARTH MOON BARYCENTER"},
    Entry{3, "EARTH-MOON BARYCENTER"},
    Entry{3, "EARTH BARYCENTER"},
    Entry{4, "MARS_BARYCENTER"},
    Entry{4, "MARS BARYCENTER"},
    Entry{5, "JUPITER_BARYCENTER"},
    Entry{5, "JUPITER BARYCENTER"},
    Entry{6, "SATURN_BARYCENTER"},
    Entry{6, "SATURN BARYCENTER"},
    Entry{7, "URANUS_BARYCENTER"},
    Entry{7, "URANUS BARYCENTER"},
    Entry{8, "NEPTUNE_BARYCENTER"},
    Entry{8, "NEPTUNE BARYCENTER"},
    Entry{9, "PLUTO_BARYCENTER"},
    Entry{9, "PLUTO BARYCENTER"},
    Entry{10, "SUN"},
    Entry{199, "MERCURY"},
    Entry{299, "VENUS"},
    Entry{399, "EARTH"},
    Entry{301, "MOON"},
    Entry{499, "MARS"},
    Entry{401, "PHOBOS"},
    Entry{402, "DEIMOS"},
    Entry{599, "JUPITER"},
    Entry{501, "IO"},
    Entry{502, "EUROPA"},
    Entry{503, "GANYMEDE"},
    Entry{504, "CALLISTO"},
    Entry{505, "AMALTHEA"},
    Entry{506, "HIMALIA"},
    Entry{507, "ELARA"},
    Entry{508, "PASIPHAE"},
    Entry{509, "SINOPE"},
    Entry{510, "LYSITHEA"},
    Entry{511, "CARME"},
    Entry{512, "ANANKE"},
    Entry{513, "LEDA"},
    Entry{514, "THEBE"},
    Entry{515, "ADRASTEA"},
    Entry{516, "METIS"},
    Entry{517, "CALLIRRHOE"},
    Entry{518, "THEMISTO"},
    Entry{699, "SATURN"},
    Entry{601, "MIMAS"},
    Entry{602, "ENCELADUS"},
    Entry{603, "TETHYS"},
    Entry{604, "DIONE"},
    Entry{605, "RHEA"},
    Entry{606, "TITAN"},
    Entry{607, "HYPERION"},
    Entry{608, "IAPETUS"},
    Entry{609, "PHOEBE"},
    Entry{610, "JANUS"},
    Entry{611, "EPIMETHEUS"},
    Entry{612, "HELENE"},
    Entry{613, "TELESTO"},
    Entry{614, "CALYPSO"},
    Entry{615, "ATLAS"},
    Entry{616, "PROMETHEUS"},
    Entry{617, "PANDORA"},
    Entry{618, "PAN"},
    Entry{632, "METHONE"},
    Entry{633, "PALLENE"},
    Entry{634, "POLYDEUCES"},
    Entry{635, "DAPHNIS"},
    Entry{649, "ANTHE"},
    Entry{653, "AEGAEON"},
    Entry{799, "URANUS"},
    Entry{701, "ARIEL"},
    Entry{702, "UMBRIEL"},
    Entry{703, "TITANIA"},
    Entry{704, "OBERON"},
    Entry{705, "MIRANDA"},
    Entry{706, "CORDELIA"},
    Entry{707, "OPHELIA"},
    Entry{708, "BIANCA"},
    Entry{709, "CRESSIDA"},
    Entry{710, "DESDEMONA"},
    Entry{711, "JULIET"},
    Entry{712, "PORTIA"},
    Entry{713, "ROSALIND"},
    Entry{714, "BELINDA"},
    Entry{715, "PUCK"},
    Entry{716, "CALIBAN"},
    Entry{717, "SYCORAX"},
    Entry{899, "NEPTUNE"},
    Entry{801, "TRITON"},
    Entry{802, "NEREID"},
    Entry{803, "NAIAD"},
    Entry{804, "THALASSA"},
    Entry{805, "DESPINA"},
    Entry{806, "GALATEA"},
    Entry{807, "LARISSA"},
    Entry{808, "PROTEUS"},
    Entry{999, "PLUTO"},
    Entry{901, "CHARON"},
    Entry{902, "NIX"},
    Entry{903, "HYDRA"},
    Entry{904, "KERBEROS"},
    Entry{905, "STYX"},
    Entry{1000005, "BORRELLY"},
    Entry{1000012, "67P/CHURYUMOV-GERASIMENKO (1969 R1)"},
    Entry{1000012, "CHURYUMOV-GERASIMENKO"},
    Entry{1000036, "HALLEY"},
    Entry{1000041, "HARTLEY 2"},
    Entry{1000093, "TEMPEL_1"},
    Entry{1000093, "TEMPEL 1"},
    Entry{1000107, "WILD 2"},
    Entry{2000001, "CERES"},
    Entry{2000002, "PALLAS"},
    Entry{2000004, "VESTA"},
    Entry{2000016, "PSYCHE"},
    Entry{2000021, "LUTETIA"},
    Entry{2000052, "52 EUROPA"},
    Entry{2000052, "52_EUROPA"},
    Entry{2000216, "KLEOPATRA"},
    Entry{2431010, "IDA"},
    Entry{2431011, "DACTYL"},
    Entry{2000253, "MATHILDE"},
    Entry{2000433, "EROS"},
    Entry{2000511, "DAVIDA"},
    Entry{2002867, "STEINS"},
    Entry{2004015, "WILSON-HARRINGTON"},
    Entry{2004179, "TOUTATIS"},
    Entry{2009969, "BRAILLE"},
    Entry{9511010, "GASPRA"},
    Entry{2025143, "ITOKAWA"},
    Entry{2101955, "BENNU"},
    Entry{2162173, "RYUGU"},
    Entry{2486958, "ARROKOTH"},
    Entry{20065803, "DIDYMOS BARYCENTER"},
    Entry{120065803, "DIMORPHOS"},
    Entry{920065803, "DIDYMOS"},
    Entry{20052246, "DONALDJOHANSON"},
    Entry{1000109, "WIRTANEN"},
    Entry{1000132, "HALE-BOPP"},
    Entry{1003228, "C/2013 A1"},
    Entry{-1, "GEOTAIL"},
    Entry{-5, "AKATSUKI"},
    Entry{-21, "SOHO"},
    Entry{-23, "PIONEER-10"},
    Entry{-24, "PIONEER-11"},
    Entry{-28, "JUICE"},
    Entry{-29, "STARDUST"},
    Entry{-31, "VG1"},
    Entry{-31, "VOYAGER 1"},
    Entry{-32, "VG2"},
    Entry{-32, "VOYAGER 2"},
    Entry{-37, "HAYABUSA 2"},
    Entry{-37, "HAYABUSA2"},
    Entry{-40, "CLEMENTINE"},
    Entry{-41, "MEX"},
    Entry{-41, "MARS EXPRESS"},
    Entry{-48, "HUBBLE SPACE TELESCOPE"},
    Entry{-48, "HST"},
    Entry{-49, "LUCY"},
    Entry{-53, "MARS ODYSSEY"},
    Entry{-55, "ULYSSES"},
    Entry{-61, "JUNO"},
    Entry{-64, "ORX"},
    Entry{-64, "OSIRIS-REX"},
    Entry{-74, "MRO"},
    Entry{-74, "MARS RECON ORBITER"},
    Entry{-76, "MSL"},
    Entry{-77, "GLL"},
    Entry{-77, "GALILEO ORBITER"},
    Entry{-79, "SIRTF"},
    Entry{-79, "SPITZER"},
    Entry{-82, "CAS"},
    Entry{-82, "CASSINI"},
    Entry{-85, "LRO"},
    Entry{-85, "LUNAR RECONNAISSANCE ORBITER"},
    Entry{-93, "NEAR"},
    Entry{-93, "NEAR EARTH ASTEROID RENDEZVOUS"},
    Entry{-94, "MGS"},
    Entry{-94, "MARS GLOBAL SURVEYOR"},
    Entry{-96, "SPP"},
    Entry{-96, "PARKER SOLAR PROBE"},
    Entry{-98, "NEW_HORIZONS"},
    Entry{-98, "NEW HORIZONS"},
    Entry{-121, "BEPICOLOMBO MPO"},
    Entry{-130, "MUSES-C"},
    Entry{-130, "HAYABUSA"},
    Entry{-131, "KAGUYA"},
    Entry{-131, "SELENE"},
    Entry{-135, "DART"},
    Entry{-140, "EPOXI"},
    Entry{-140, "DEEP IMPACT FLYBY SPACECRAFT"},
    Entry{-143, "TGO"},
    Entry{-144, "SOLAR ORBITER"},
    Entry{-151, "CHANDRA"},
    Entry{-159, "EUROPA CLIPPER"},
    Entry{-170, "JWST"},
    Entry{-170, "JAMES WEBB SPACE TELESCOPE"},
    Entry{-203, "DAWN"},
    Entry{-226, "ROSETTA"},
    Entry{-227, "KEPLER"},
    Entry{-234, "STEREO AHEAD"},
    Entry{-235, "STEREO BEHIND"},
    Entry{-236, "MESSENGER"},
    Entry{-238, "SMART1"},
    Entry{-248, "VEX"},
    Entry{-248, "VENUS EXPRESS"},
    Entry{-255, "PSYC"},
};

} // namespace

BodyNames::BodyNames(const KernelPool& pool) {
    const auto add = [this](std::string_view text, int id) {
        const std::string name = kernel_name(text);
        // A name that a kernel gives to another body is no longer that of the first.
        const auto present = ids_.find(name);
        if (present != ids_.end() && present->second != id && names_[present->second] == name)
            names_.erase(present->second);
        ids_[name] = id;
        names_[id] = name;
    };
    for (const Entry& entry : entries)
        add(entry.name, entry.id);
    const KernelPool::Variable* const names = pool.find("NAIF_BODY_NAME");
    const KernelPool::Variable* const codes = pool.find("NAIF_BODY_CODE");
    const std::size_t given = names == nullptr ? 0 : names->strings.size();
    const std::size_t numbered = codes == nullptr ? 0 : codes->numbers.size();
    if (given != numbered) {
        problem_ = fmt::format("{}: {} names but {} codes (NAIF_BODY_CODE): none of them is used",
                               (names != nullptr ? names : codes)->place, given, numbered);
        return;
    }
    for (std::size_t i = 0; i < given; ++i) {
        const double code = codes->numbers[i];
        if (code != std::floor(code) || std::abs(code) > 2147483647.0) {
            problem_ = fmt::format("{}: {} is not a whole number of 32 bits: {} is not used", codes->place,
                                   code, names->strings[i]);
            continue;
        }
        add(names->strings[i], static_cast<int>(code));
    }
}

std::optional<int> BodyNames::id(std::string_view name) const {
    const std::string key = kernel_name(name);
    if (const auto found = ids_.find(key); found != ids_.end()) return found->second;
    int number = 0;
    const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), number);
    if (error == std::errc() && end == key.data() + key.size()) return number;
    return std::nullopt;
}

std::string BodyNames::name(int id) const {
    const auto found = names_.find(id);
    return found == names_.end() ? std::to_string(id) : found->second;
}

std::string BodyNames::suggestion(std::string_view name) const {
    std::vector<std::string_view> known;
    for (const auto& [text, id] : ids_)
        known.push_back(text);
    const std::string text = obscura::suggestion(kernel_name(name), known);
    return text.starts_with("did you mean") ? text : "give a name that SPICE knows or a NAIF code";
}

} // namespace obscura::ephemeris
