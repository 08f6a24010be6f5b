// The part as a cutter meets it in one layer: solid ∩ {z ≤ z_top}, all that stands below the layer's top
// (higher layers are not there yet, lower ones are). Every cutter here reaches from its lower end upwards
// without end, so what matters of the part is its shadow, the set of points that have part at or above them:
// a cutter touches the one exactly if it touches the other, and just as deep. Nothing here is sampled: a
// straight motion is one convex problem per facet.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/access/near_facets.h"
#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/cutter_shape.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/bulk_memory.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Where a cutter is deepest in the part during a motion.
struct Penetration {
    double depth = 0;  ///< mm; 0 when nothing deeper than asked was found
    Point3 tip{};      ///< the tip's place then
    bool found = false;
};

/// A tree over the facets of a mesh, built once and used for every layer. Borrows nothing: it copies the
/// facets. Const functions may be called from many threads at once. Deterministic.
class StandingPart {
public:
    StandingPart(Context& context, MeshView mesh);

    /// Material thinner than this under a layer's top is not counted: a facet that lies in the top plane to
    /// within rounding of float32 and of the plan's text belongs to the next layer. All depths may be short
    /// by this, mm.
    static constexpr double kSheet = 0.001;
    /// A motion is treated in pieces, mm: their length, what they may rise, and the length of a cylinder's
    /// that goes up or down. The result depends on none of them.
    static constexpr double kSpan = 8, kRise = 1, kPiece = 0.5;
    /// Error of a depth by numerical minimisation, mm.
    static constexpr double kNumericalError = 1e-7;

    /// Largest depth of part in a cutter, and its shank of the same radius, over a straight motion of its
    /// tip. Depth of a point in a cutter is its distance from the cutter's surface, so that a wall that is
    /// cut too deep by d counts d, whatever its slope; in an upright cylinder, which has no upper end (flat
    /// end mill, face mill, shank, holder), the lesser of its distances from the wall and from the floor.
    /// @param under the cutter's under side, or that of a holder, which needs no cutter's measures
    /// @param at_least only depths above this are looked for (0 or more), mm
    [[nodiscard]] Penetration depth_under(const Envelope& under, double z_top, const Point3& from,
                                          const Point3& to, double at_least) const;
    /// The same for a cutter; one without a radius is in nothing.
    /// @throws Error(usage, "tool.shape") for other measures that make no cutter
    [[nodiscard]] Penetration depth(const CutterShape& cutter, double z_top, const Point3& from,
                                    const Point3& to, double at_least) const {
        if (!(cutter.radius > 0)) return {0, from, false};
        return depth_under(under_side(cutter), z_top, from, to, at_least);
    }
    /// The same for a ball.
    [[nodiscard]] Penetration ball(double z_top, const Point3& from, const Point3& to, double radius,
                                   double at_least) const {
        return depth({radius, radius, 0}, z_top, from, to, at_least);
    }
    /// The same for a cylinder.
    [[nodiscard]] Penetration cylinder(double z_top, const Point3& from, const Point3& to, double radius,
                                       double at_least) const {
        return depth({radius, 0, 0}, z_top, from, to, at_least);
    }

    /// The same for a drill that stands with its point at `tip`: a cone under a cylinder of `radius`. Whoever
    /// went straight down to there was nowhere deeper in the part.
    /// @param taper_rad between the axis and the cone's flank
    [[nodiscard]] Penetration pointed(double z_top, const Point3& tip, double radius, double taper_rad,
                                      double at_least) const;

    struct Motion {
        Point3 from, to;
    };
    /// Motions [first, last) of a row that run along a level circle: their ends lie on it, mm.
    struct Chords {
        std::size_t first, last;
        double x, y, radius;
    };
    /// What motions that are checked together have in common.
    struct Found {
        Penetration most;                   ///< of equals the first
        std::size_t motion = 0;             ///< that has it
        std::vector<std::uint32_t> beyond;  ///< motions deeper than the tolerance, ascending
    };
    /// The same for a row of motions, best for such as follow one another closely: what of the part is near
    /// is looked for once for many.
    /// @param ignore depths up to this are not looked for (0 or more), mm
    /// @param tolerance every motion deeper than this is found, of the others only those that are deeper than
    /// all before, mm
    /// @param known of a ball: the greatest depth of rows that are checked together, each with this. Only
    /// what may be the greatest of all is found
    ///        then, and is the same in whichever order they are. (A cylinder's depth differs in its last
    ///        digits with what is known.)
    /// @param chords of the motions that run along circles, in their order: what is found is the same, but
    /// sooner
    [[nodiscard]] Found deepest_under(const Envelope& under, double z_top, std::span<const Motion> motions,
                                      double ignore, double tolerance, std::atomic<double>* known = nullptr,
                                      std::span<const Chords> chords = {}) const;
    /// The same for a cutter, as depth() has it.
    [[nodiscard]] Found deepest(const CutterShape& cutter, double z_top, std::span<const Motion> motions,
                                double ignore, double tolerance, std::atomic<double>* known = nullptr,
                                std::span<const Chords> chords = {}) const {
        if (!(cutter.radius > 0)) return {};
        return deepest_under(under_side(cutter), z_top, motions, ignore, tolerance, known, chords);
    }

    /// Whether there is part just under the plane z at (x, y).
    [[nodiscard]] bool covered(double x, double y, double z) const;

    /// The largest z ≤ z_top of the part over (x, y); `none` where there is no part.
    [[nodiscard]] double envelope(double x, double y, double z_top, double none) const;

    /// How far something stands away, and which way: `away` leads from its nearest point to the point asked
    /// for.
    struct Clearance {
        double distance = 0;  ///< mm; the limit when nothing is nearer
        Point3 away{};
    };
    /// From a point to the shadow of the part below z_top; 0 within it.
    [[nodiscard]] Clearance from_shadow(const Point3& point, double z_top, double limit) const {
        const bool in_reach = point[2] - (z_top - kSheet) < limit;
        return from_shadow(point, z_top, limit, in_reach && covered(point[0], point[1], z_top - kSheet));
    }
    /// The same where it is known whether there is part just under the top at (x, y).
    [[nodiscard]] Clearance from_shadow(const Point3& point, double z_top, double limit, bool covered) const;
    /// Horizontally from an upright line through (x, y) to what of the part stands higher than z (and below
    /// z_top); 0 within it.
    [[nodiscard]] Clearance beside(const Point3& point, double z_top, double limit) const;

    /// From a point to the nearest facet, whatever its height; the limit when none is nearer. Of what is no
    /// farther than `enough` the first found.
    [[nodiscard]] double from_facets(const Point3& point, double limit, double enough = 0) const;

    /// The greatest distance from a corner or middle of its facets to the nearest facet of another part, mm;
    /// `known` when none is greater or either has none.
    [[nodiscard]] double farthest_from(Context& context, const StandingPart& other, double known) const;
    [[nodiscard]] std::size_t facet_count() const { return facets_.size(); }

    /// Lowest and highest z, and the extent in x and y, of the facets.
    [[nodiscard]] Box3 box() const { return box_; }

private:
    struct Facet {
        std::array<Vec3f, 3> v;
    };
    /// The facets, eight that follow one another together.
    class Facets {
    public:
        /// Of indeterminate facets.
        void resize(std::size_t size) { eights_.resize(((size_ = size) + 7) / 8); }
        void set(std::size_t i, const Facet& facet);
        /// What the last eight hold beyond the end is not a number then: no facet that is near anything.
        void end();
        [[nodiscard]] std::size_t size() const { return size_; }
        [[nodiscard]] bool empty() const { return size_ == 0; }
        [[nodiscard]] Facet operator[](std::size_t i) const {
            const EightFacets& e = eights_[i / 8];
            const std::size_t k = i % 8;
            return {
                {{{e.x0[k], e.y0[k], e.z0[k]}, {e.x1[k], e.y1[k], e.z1[k]}, {e.x2[k], e.y2[k], e.z2[k]}}}};
        }
        [[nodiscard]] const EightFacets& eight(std::size_t i) const { return eights_[i]; }

    private:
        std::size_t size_ = 0;
        BulkVector<EightFacets> eights_;
    };
    struct Node {
        float x0, y0, z0, x1, y1, z1;
    };
    /// Boxes of eight nodes that follow one another, as rows of numbers; those that there are none of are
    /// empty.
    struct Nodes {
        std::array<float, 8> x0, y0, z0, x1, y1, z1;
        [[nodiscard]] Node operator[](std::size_t k) const {
            return {x0[k], y0[k], z0[k], x1[k], y1[k], z1[k]};
        }
    };
    /// A box in single precision; it holds what it was made of.
    struct Within {
        Within(const Point3& low, const Point3& high);
        std::array<float, 3> low, high;
    };
    /// Nodes of one level to look at in one go.
    struct ManyNodes {
        static constexpr std::size_t kMost = 8;
        std::array<const Nodes*, kMost> eights;
        std::size_t count = 0;
    };
    // Bit k of kept[i] is 1 where node k of eight i is kept, else 0.
    static void overlapping(const ManyNodes& many, const Within& box, unsigned* kept);
    template <class Choose, class Visit>
    void walk_leaves(Choose&& choose, Visit&& visit) const;
    template <class Enter, class Visit>
    void walk(Enter&& enter, Visit&& visit) const;
    template <class Visit>
    void walk_within(const Within& box, Visit&& visit) const;
    /// What is asked of boxes: how far a point is from the facets in them, or from the shadow of these below
    /// the top; or how far, horizontally, from what is higher than it.
    struct Away {
        enum class Kind : char { facets, shadow, beside } kind;
        Point3 point;
        double top;
    };
    /// Squares of the distances from a point to eight boxes, mm²; infinite where a box holds nothing that is
    /// asked for.
    static void squares(const Nodes& nodes, const Away& from, std::array<double, 8>& squares);
    static void boxes(const EightFacets& facets, Nodes& boxes);
    template <class Limit, class Visit>
    void walk_nearest(const Away& from, Limit&& limit, Visit&& visit) const;
    /// A facet and how far it is from a place.
    struct Near {
        double distance;  ///< mm
        std::uint32_t facet;
    };
    /// The nearest facet, or the first found that is no farther than `enough`; `known` when none is nearer.
    [[nodiscard]] Near nearest(const Point3& point, const Near& known, double enough) const;
    [[nodiscard]] double distance(const Point3& point, std::uint32_t facet) const;
    struct Stretch;
    struct Search;
    static void around(const ManyNodes& many, const WayAround& way, const Within& box, unsigned* kept);
    bool gather(Search& search, Stretch& stretch, double depth, std::size_t most) const;
    bool arc_from(Search& search, Stretch& stretch, std::span<const Motion> motions, std::size_t m,
                  double depth) const;
    bool stretch_from(Search& search, Stretch& stretch, std::span<const Motion> motions, std::size_t m,
                      double depth) const;
    friend class RisingEnvelope;
    Facets facets_;  ///< in Morton order
    std::vector<BulkVector<Nodes>>
        levels_;  ///< levels_[0] covers kFan facets a node, levels_[k] kFan nodes of level k − 1
    Box3 box_{};
    bool closed_ = false;  ///< by its neighbours: every edge is gone along as often one way as the other
};

/// The envelope (StandingPart::envelope) over a grid of nx × ny points (x0 + i·cell, y0 + j·cell), row j
/// after row j − 1, for planes that rise, by scan conversion: a facet is looked at once at first and then as
/// its heights are passed.
class RisingEnvelope {
public:
    /// The part must outlive it.
    RisingEnvelope(const StandingPart& part, double x0, double y0, double cell, int nx, int ny);
    /// @pre z_top is no lower than when asked before  @param out gets nx × ny heights; `none` where there is
    /// no part
    void at(double z_top, float none, float* out);

    /// Of each column the length of air that has part over it, between `z_bottom` and the plane asked for
    /// last, mm: what a layer that is milled from above leaves filled. The planes asked for before lie no
    /// higher than `z_bottom`. @param out gets nx × ny lengths
    void covered_air(double z_bottom, float* out);

private:
    template <class Fn>
    void for_each_point(double z_low, double z_high, Fn&& fn) const;
    /// Where a column passes through a facet.
    struct Crossing {
        std::uint32_t column;
        std::int32_t winding;
        double z;
    };
    const StandingPart* part_;
    double x0_, y0_, cell_;
    int nx_, ny_;
    double passed_;                    // facets are looked at up to here
    std::vector<std::int32_t> above_;  // winding number of what is there or higher
    std::vector<float> below_;         // highest of what is lower
    std::vector<Crossing> crossings_;  // between the last two planes
};

}  // namespace slabwright
