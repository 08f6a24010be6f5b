// Which cut next? The nearest one, found among very many in the time of a few.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// A place (0.1 µm) at which a run may begin, and the one where it then ends; `place` says which of its
/// places, in the caller's words.
struct Beginning {
    Point2 at{}, end{};
    std::uint32_t run = 0, place = 0;
};

/// Answers for the nearest beginning of the runs that are left. Of equals that of the lowest run, then the
/// lowest place: the order of a path must not depend on anything but its runs. n beginnings take O(n log n)
/// to set up.
class NearestRuns {
public:
    NearestRuns(std::vector<Beginning> beginnings, std::size_t runs);
    [[nodiscard]] bool empty() const { return nodes_.empty() || left_[root_] == 0; }
    /// REQUIRES: not empty.
    [[nodiscard]] Beginning nearest(Point2 to) const;
    /// Takes a run out with all of its beginnings.
    void remove(std::uint32_t run);
    /// Puts a run that was taken out back in.
    void restore(std::uint32_t run);

private:
    static constexpr std::uint32_t kNone = UINT32_MAX;
    std::uint32_t build(std::uint32_t first, std::uint32_t last, bool by_y, std::uint32_t parent);
    std::vector<Beginning> nodes_;  // a k-d tree: a range's middle is its root
    std::vector<std::uint32_t> low_, high_, parent_, left_;
    std::vector<char> gone_;
    std::vector<std::uint32_t> starts_, members_;  // nodes by run
    std::uint32_t root_ = kNone;
};

/// Everything in one go from `at`: for each run, in the order of visits, where it begins. Always the nearest.
[[nodiscard]] std::vector<Beginning> nearest_order(std::vector<Beginning> beginnings, std::size_t runs,
                                                   Point2 at);

/// The same visits, of runs that may be made either way, in an order in which the ways between them are
/// shorter: stretches of it are turned, and few visits moved, as long as that shortens the whole by more than
/// rounding. Of long orders only what is near in the order is looked at together, so that n visits take about
/// as much time for each, however many they are.
/// @param from where the first way begins; the last visit may end anywhere
[[nodiscard]] std::vector<Beginning> shortened(std::vector<Beginning> order, Point2 from);

}  // namespace slabwright
