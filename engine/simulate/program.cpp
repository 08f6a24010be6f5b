#include "engine/simulate/program.h"

#include <algorithm>

namespace slabwright {

CuttingFeeds cutting_feeds(const Program& program) {
    CuttingFeeds feeds;
    for (std::size_t k = 1; k < program.steps.size(); ++k) {
        const ProgramStep &from = program.steps[k - 1], &to = program.steps[k];
        if (to.rapid() || !from.known() || !to.known()) continue;
        if (from.x != to.x || from.y != to.y) {
            feeds.low = feeds.high > 0 ? std::min(feeds.low, to.feed) : to.feed;
            feeds.high = std::max(feeds.high, to.feed);
        } else if (to.z < from.z) {
            feeds.plunge = std::max(feeds.plunge, to.feed);
        }
    }
    return feeds;
}

}  // namespace slabwright
