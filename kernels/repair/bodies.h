// Which closed bodies are inside out.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct TurnedBodies {
    std::uint64_t count = 0;
    double volume_mm3 = 0;  ///< of the largest
    Xyz where{};            ///< middle of its first facet
};

/// Bodies that enclose nothing.
struct EmptyBodies {
    std::uint64_t count = 0;
    double area_mm2 = 0;       ///< of the largest
    Xyz where{};               ///< a corner of it
    std::vector<bool> facets;  ///< by facet: belongs to one
};
/// Thinner than this on average, a body encloses nothing, mm: its two faces are one joint.
inline constexpr double kEmptyMm = 1e-3;
/// @param body_of by facet, a number of its body
[[nodiscard]] EmptyBodies find_empty_bodies(const FacetSoup& soup, std::span<const std::uint32_t> body_of);

/// Turns over the bodies of negative volume that lie in no material of others (the winding number of these is
/// 0 there), with all that lies in them: an outer shell faces outwards, and a cavity stays one. A body whose
/// facets faced both ways (`unsure`) and that lies in another is taken for a cavity.
/// @param body_of by facet, a number of its body
/// @param unsure by facet, of those that were there before holes were filled
TurnedBodies turn_bodies(Context& context, FacetSoup& soup, std::span<const std::uint32_t> body_of,
                         const std::vector<bool>& unsure);

}  // namespace slabwright
