// What a simulation found wrong with a layer, in terms of its plan: the front door makes it of what the proof
// read from text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/simulate/simulate.h"

namespace slabwright {

/// A move of an operation that does what it must not.
struct FaultyMove {
    enum class Fault : std::uint8_t {
        gouge,       ///< cutter, shank or holder go into the part
        crush,       ///< the core comes down on stock
        rapid,       ///< a rapid takes stock
        too_deep,    ///< takes more at once than it may
        in_standing  ///< shank or holder run into standing stock
    } fault{};
    std::size_t move = 0;  ///< index into Operation::moves
    double size = 0;       ///< mm, as FaultyMotion::size; 0 for a gouge
};

struct OperationFaults {
    std::size_t operation = 0;      ///< index into Layer::operations
    bool empty = false;             ///< it removes nothing
    std::vector<FaultyMove> moves;  ///< by fault, then ascending
};

/// All that is wrong with one layer.
struct LayerFaults {
    std::size_t layer = 0;  ///< index into Plan::layers
    std::vector<OperationFaults> operations;
    std::vector<MissedPlace> missed;  ///< where a tool could still take something that is worth it
    double lowest_tip = 0;            ///< mm, LayerFindings::lowest_tip
    std::string found;                ///< in words, for the diagnostic: "a gouge of 0.88 mm, …"
};

}  // namespace slabwright
