// What a stack of sheets is laid into while it is bonded: a full nest, or an egg crate (METHOD.md section 13;
// FDFF chapter II).
#pragma once

#include <string>
#include <vector>

#include "engine/sheets/sheet_slicing.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

struct FixtureRules {
    double margin = 30;      ///< mm of the block around the part
    double clearance = 0.2;  ///< mm between fixture and part, and in slots
    double thickness = 6;    ///< mm: of the crate's sheets
    double floor = 20;       ///< mm of the crate under the part
    int slices_x = 3, slices_y = 3;
};

/// One flat piece of a fixture.
struct FixturePiece {
    std::string name;  ///< "nest_01", "crate_x1", "crate_y1"
    Loops
        region;  ///< of a nest in x and y; of a crate's slice square to x in y and z, square to y in x and z
    double at = 0;  ///< mm: the bottom of a nest's sheet; where a slice's middle stands in x or y
};

/// The block less the part, sheet by sheet: of every sheet of the stack the one around it.
/// @param outlines as the sheets are cut. @throws Error(usage, "sheets.fixture") for rules out of range
[[nodiscard]] std::vector<FixturePiece> full_nest(const std::vector<SheetSpan>& spans,
                                                  const std::vector<Loops>& outlines,
                                                  const FixtureRules& rules);

/// Slices of the block less the part and of all above it, so that sheets are laid in from above; half-lapped:
/// those square to x are slotted from above, those square to y from below.
/// @param mesh on z = 0, with neighbours. @throws Error(usage, "sheets.fixture"), and as slice()
[[nodiscard]] std::vector<FixturePiece> egg_crate(Context& context, const Mesh& mesh,
                                                  const FixtureRules& rules);

}  // namespace slabwright
