// End mills that a shop can buy: what router and mould cutters' catalogues have (METHOD.md section 6).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slabwright {

struct CatalogueSize {
    double diameter_mm = 0;
    std::string words;  ///< "6 mm", "1/4 in"
};

/// mm between flutes and collet: each more bends a thin tool more.
inline constexpr double kCatalogueGrip = 3;

/// Straight tools, the thickest first: 12 to 1 mm, or 1/2 to 1/32 in. Larger ones are in every library.
[[nodiscard]] std::vector<CatalogueSize> catalogue_sizes(bool inch);

/// The shortest flutes of that diameter that are at least `needed_mm` long: standard, long, extra long, or
/// with a relieved neck, up to twelve diameters. None where these are too short.
[[nodiscard]] std::optional<double> catalogue_flutes(double diameter_mm, double needed_mm);

/// The longest there are.
[[nodiscard]] double longest_catalogue_flutes(double diameter_mm);

}  // namespace slabwright
