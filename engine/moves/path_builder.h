// Puts moves one after another into an operation: rapids only above the stock, down by feed. A builder that
// knows what stands around it links its cuts by the shortest way that it can prove.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "engine/moves/thinning.h"
#include "engine/plan.h"
#include "engine/stock/standing.h"
#include "kernels/cutting/drop.h"

namespace slabwright {

/// What a cutter must know of its surroundings to go straight from one cut to the next.
struct Surroundings {
    Standing* standing = nullptr;  ///< what may stand; the builder cuts its own moves into it
    const DropIndex* part =
        nullptr;  ///< drops of this very cutter, or of a wider one; none: it never stays down
    CutterShape cutter;
    double under =
        0;  ///< mm that the tip of `part`'s cutter lies under this one's where their ends are concentric
    double chord = 0;  ///< mm: longest chord between places where `part` is free that is safe (safe_chord_mm)
    double ramp_deg = 5;                  ///< entry into stock
    std::shared_ptr<const Loops> room{};  ///< where the cutter's middle may be beside a flask; none: anywhere
    std::array<double, 2> reach_min{-1e9, -1e9};  ///< mm: where the machine's travel takes the tip
    std::array<double, 2> reach_max{1e9, 1e9};
    double lowest_rapid = -1e9;  ///< mm: rapids go no deeper
    double deepest = 0;          ///< mm that a run may cut at once; 0: any
    bool from_side =
        false;  ///< comes from beside a run where that is possible, rather than on a helix or a ramp
    /// Gets where a run begins that was left out in the end: neither helix nor ramp has room, and the tool
    /// does not cut straight down.
    std::vector<std::array<double, 3>>* no_way_in = nullptr;
};

class PathBuilder {
public:
    /// @param clearance_z where the program begins and ends, mm
    /// @param link_z      above all standing stock, mm: rapids between cuts run here
    PathBuilder(Operation& operation, const Tool& tool, double feed, double clearance_z, double link_z);

    /// From now on links are as low as what stands allows. Before this, rapids run at the link height.
    void set_surroundings(const Surroundings& around);

    /// Rapid to above (x, y), if not there already (0.1 µm): as low as is proven to be air on the way and
    /// over the target, else at the link height.
    void go_above(Point2 at);
    /// From where the tool is to the first point of a run, then along it. Straight at the height of the
    /// higher end where that way is free of the part and of standing stock; else above what stands. What
    /// stands at the run's start is entered on a helix that ends along the run, on its left, where the part
    /// leaves room for one; else on a ramp along the run, to and fro; up to kPlunge of it straight down, or
    /// kScrape by a tool that does not plunge. Where a run is too short for a ramp, a tool that plunges does;
    /// others come from beside it, where they have room already, or else the run is left out
    /// (Surroundings::no_way_in), as far as it goes on at that height.
    ///
    /// Helices and ramps of a tool with a core are so gentle that nothing stands higher under it than its
    /// recess (core_recess), and end on a level turn or leg that clears the rest. Where a run goes down
    /// steeply on standing stock, such a tool enters anew.
    /// Where more stands than may be cut at once (Surroundings::deepest), since an earlier level found no way
    /// in, the run is first followed higher up; where that has no way in either, it is left out. Every point
    /// of the run must be free, and so must be what lies straight above it (as of a drop or a level contour).
    void follow(std::span<const PathPoint> run);
    /// How many runs, or parts of runs, were left out so far.
    [[nodiscard]] std::size_t left_out() const { return left_out_.size(); }
    /// Follows those that were left out since there were `from` of them, as long as that brings some of them
    /// in: what was cut after them may have made room.
    void follow_left_out(std::size_t from);
    /// The steepest slope on which the tool may go down round and round a closed ring (its first point is
    /// repeated at the end); 0 where the ring is so small that its core would leave a post.
    [[nodiscard]] double slope_around(std::span<const PathPoint> ring) const;
    /// Straight down (or up) by plunge feed to z.
    void plunge(std::int32_t z);
    /// Fast down to z through air that is known to be empty: space already cut, or beside the stock. Still by
    /// feed.
    void sink(std::int32_t z);
    /// Cuts to a point.
    void cut(Point2 to, std::int32_t z);
    /// Done with this cut: up to the link height, or, with known surroundings, as far up as the next link
    /// needs.
    void retract();
    /// Ends the program; drops it when nothing was cut. Returns whether something was.
    bool finish();

    [[nodiscard]] bool is_down() const { return down_; }
    [[nodiscard]] Point2 at() const { return {x_, y_}; }
    [[nodiscard]] std::int32_t z() const { return z_; }
    /// Whether the machine's travel and a flask leave room for the cutter's middle here.
    [[nodiscard]] bool has_room(Point2 at) const {
        return to_mm(at.x) >= around_.reach_min[0] && to_mm(at.x) <= around_.reach_max[0] &&
               to_mm(at.y) >= around_.reach_min[1] && to_mm(at.y) <= around_.reach_max[1] &&
               (!around_.room || winding(*around_.room, at) > 0);
    }
    /// How low the cutter gets over a place before it meets what is known to stand; −infinity when nothing
    /// is.
    [[nodiscard]] double standing_tip(Point2 at);
    /// The same for the cutter's middle: what stands there would be entered head-on, not sliced from its
    /// side.
    [[nodiscard]] double standing_middle(Point2 at);

    static constexpr double kOver = 1.0;  ///< mm of air under a rapid that goes across
    static constexpr double kStop = 0.5;  ///< mm of air where a rapid or fast feed goes down
    static constexpr double kPlunge =
        0.5;  ///< mm of stock that a tool that plunges enters straight down rather than on a ramp
    static constexpr double kScrape =
        0.2;  ///< mm of stock that the middle of any other may meet on its way down
    static constexpr double kMiddle =
        0.6;  ///< of a flat end mill's radius: what it does not enter straight down
    static constexpr double kRim =
        1.0;  ///< mm from a face mill's rim inwards in which something may stand where it goes straight down
    static constexpr double kSliver =
        0.05;                             ///< mm: what is no wider beside a flat end mill is not looked for
    static constexpr double kBite = 0.1;  ///< mm that a tool may meet where it stays down
    static constexpr double kLongestWay = 40.0;  ///< mm that it stays down; above, lifting is quicker

private:
    // Where the tool is, and after which move.
    struct Mark {
        std::size_t moves = 0;
        Move last;
        std::int32_t x = 0, y = 0, z = 0, above = 0;
        bool started = false, down = false;
    };
    struct Helix {
        std::vector<std::array<double, 2>> circle;  // mm, its first place again at the end
        double slope = 0, radius = 0;               // mm
    };
    [[nodiscard]] Mark here() const;
    void go_back(const Mark& mark);
    [[nodiscard]] std::optional<Helix> helix(std::array<double, 2> middle, double radius, double ux,
                                             double uy, std::int32_t z, bool known) const;
    bool wind_down(const Helix& helix, const PathPoint& end);
    void add(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t feed);
    void learn();
    [[nodiscard]] CutterShape middle() const;
    [[nodiscard]] double slope_under_core(double way) const;
    [[nodiscard]] double slope_to_and_fro(std::span<const PathPoint> line) const;
    [[nodiscard]] bool comes_down_on_stock(const PathPoint& to);
    void follow_at_once(std::span<const PathPoint> run);
    [[nodiscard]] std::size_t follow_part(std::span<const PathPoint> run);
    [[nodiscard]] std::size_t stretch_at_once(std::span<const PathPoint> run, double& top);
    bool cut_down_to(std::span<const PathPoint> stretch, double top);
    [[nodiscard]] bool straight_is_free(Point2 to, std::int32_t z);
    void descend(const PathPoint& to);
    void land(std::int32_t z);
    [[nodiscard]] bool enter(std::span<const PathPoint> run);
    void leave_out(std::span<const PathPoint> run);
    [[nodiscard]] bool enter_on_helix(std::span<const PathPoint> run);
    [[nodiscard]] bool enter_on_ramp(std::span<const PathPoint> run);
    [[nodiscard]] std::optional<Point2> place_beside(const PathPoint& first);
    [[nodiscard]] bool enter_from_side(const PathPoint& first);
    [[nodiscard]] bool enter_beside(const PathPoint& first);
    [[nodiscard]] bool is_free(const PathPoint& p) const;
    bool wind_down_around(const PathPoint& middle, double ux, double uy, const PathPoint& to);
    bool ramp_down_from(const PathPoint& from, const PathPoint& to);
    bool ramp_down(std::vector<PathPoint> stretch, double length);
    [[nodiscard]] bool go_straight(Point2 to, std::int32_t z);
    [[nodiscard]] bool part_leaves_way(Point2 from, Point2 to, std::int32_t z) const;
    Operation& operation_;
    Surroundings around_;
    std::size_t learnt_ = 0;  // moves that have been cut into what stands
    std::int32_t above_ =
        INT32_MIN;  // where the air ends over the place that go_above() went to, as far as is proven
    std::uint32_t feed_, plunge_feed_, sink_feed_;
    std::int32_t clearance_, link_;
    std::int32_t x_ = 0, y_ = 0, z_ = 0;
    bool started_ = false, down_ = false, plunges_ = false, face_ = false;
    double core_ = 0, recess_ = 0;  // mm: the core's radius, and how much may stand under it
    double ramp_limit_deg_ = 90;
    std::vector<std::vector<PathPoint>> left_out_;
};

}  // namespace slabwright
