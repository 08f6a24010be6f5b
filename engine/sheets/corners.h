// Where a jet slows down: it lags behind its head, and at a corner would cut the lag into the part's side.
#pragma once

#include <vector>

#include "engine/sheets/head.h"

namespace slabwright {

struct CornerRules {
    double share = 0.5;    ///< of the feed, over 0; 1: nowhere slower
    double reach = 1;      ///< mm of the way before and after a corner
    double turn_deg = 30;  ///< by which a way turns within `reach` where it has a corner
};

/// A way with points where its feed changes.
struct PacedWay {
    std::vector<HeadPoint> points;
    std::vector<double> shares;  ///< of the feed, of the move to each point; the first is 1
};

/// @param way closed, as head_way() makes it
[[nodiscard]] PacedWay slowed_at_corners(const std::vector<HeadPoint>& way, const CornerRules& rules);

}  // namespace slabwright
