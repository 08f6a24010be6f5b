// A program that faces a spoilt layer off, held against what it may do, from its text alone.
#pragma once

#include <array>
#include <vector>

#include "engine/simulate/program.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// What a program faces off: all of the stock between a joint and the stack's top, taken to stand whole.
struct BlockToFaceOff {
    std::array<double, 2> stock_min{}, stock_max{};  ///< mm
    double joint = 0, top = 0;                       ///< mm, pattern-base
    double most_mm = 0;                              ///< that may be taken at once, straight down
};

/// Violations of one program:
/// face_off.joint: it goes below the joint; what stands there stays
/// face_off.rapid: a rapid, or a motion with the spindle at rest, meets wood
/// face_off.depth: it takes more at once than it may
/// face_off.left: wood stays above the joint
/// The stock is looked at in points, no closer than half a millimetre and a million at most.
/// @param program with z from the pattern's bottom. @param tool that it loads
[[nodiscard]] std::vector<Violation> check_face_off(const Program& program, const Tool& tool,
                                                    const BlockToFaceOff& block);

}  // namespace slabwright
