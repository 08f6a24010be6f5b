#include "engine/catalogue.h"

#include <fmt/format.h>

#include "engine/job.h"

namespace slabwright {

namespace {

constexpr double kMetric[] = {12, 10, 8, 6, 5, 4, 3, 2.5, 2, 1.5, 1};
struct InchSize {
    double inches;
    const char* words;
};
constexpr InchSize kInches[] = {{0.5, "1/2"},   {0.375, "3/8"},    {0.25, "1/4"},    {0.1875, "3/16"},
                                {0.125, "1/8"}, {0.09375, "3/32"}, {0.0625, "1/16"}, {0.03125, "1/32"}};
// Flute lengths in diameters: standard, long, extra long, and with a relieved neck.
constexpr double kRatios[] = {3, 4, 6, 8, 10, 12};

}  // namespace

std::vector<CatalogueSize> catalogue_sizes(bool inch) {
    std::vector<CatalogueSize> list;
    if (inch)
        for (const InchSize& s : kInches) list.push_back({s.inches * kInch, std::string(s.words) + " in"});
    else
        for (const double d : kMetric) list.push_back({d, fmt::format("{:g} mm", d)});
    return list;
}

std::optional<double> catalogue_flutes(double diameter_mm, double needed_mm) {
    for (const double ratio : kRatios)
        if (ratio * diameter_mm >= needed_mm - 1e-9) return ratio * diameter_mm;
    return {};
}

double longest_catalogue_flutes(double diameter_mm) { return kRatios[5] * diameter_mm; }

}  // namespace slabwright
