// How near the cuts of a sheet come to the part.
#pragma once

#include <vector>

#include "engine/sheets/sheet_cuts.h"
#include "kernels/polygons/border_distance.h"

namespace slabwright {

/// One sheet's surroundings: its outline and the sections at the heights that cuts are made to fit.
struct Fitted {
    const Loops& outline;
    std::vector<double> heights;
    std::vector<const Loops*> sections;
};

/// Keeps a view of the sheet and of its sections.
class NearPart {
public:
    NearPart(const Fitted& sheet, const Kerf& kerf);
    /// The border of the section at a height.
    [[nodiscard]] const BorderDistance& border(std::size_t height) const { return borders_[height]; }
    /// By how much each place of an axis lies too near to the part, mm square to the outline: 0 where it does
    /// not. The part's corners need not lie on the rays that found it. Two polygons are nearest, and enter
    /// each other deepest, at a corner of one of them, so corners are all that is asked. @param allowed mm
    /// that it may
    [[nodiscard]] std::vector<double> too_near(const AxisLoop& axis, double allowed) const;

private:
    const Fitted& sheet_;
    Kerf kerf_;
    std::vector<BorderDistance> borders_;
    std::vector<std::size_t> owners_;
};

}  // namespace slabwright
