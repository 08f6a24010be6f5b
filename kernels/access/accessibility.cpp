#include "kernels/access/accessibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/access/facet_scene.h"
#include "kernels/access/reach_search.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/geometry/triangle.h"
#include "kernels/mesh/morton.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kUpright = 1e-4;  // rad: what faces down by less counts as upright
constexpr double kInset = 0.02;    // of a piece: its corners are tested so far within it
constexpr double kShared =
    1.5;  // of a point's distance from the corner: within it other pieces' points are hoped to be
constexpr int kMostLevels = 40;  // of halving
constexpr std::size_t kPiecesAtOnce = 128;
constexpr std::array<std::size_t, 3> kPolls{512, 2048, 8192};  // points that may tell about a limit
constexpr double kPointsASquare = 16;  // of the spacing, where a surface is taken piece by piece: at least
constexpr std::size_t kPointsAtOnce = 64;
constexpr double kSurely = 4;  // likely errors from a limit

/// A piece of a facet, in doubles.
struct Piece {
    Triangle t;
    std::uint32_t item = 0;  ///< which of the facets to be machined
};

double area_of(const Triangle& t) {
    const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
    const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
    const double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    return std::sqrt(x * x + y * y + z * z) / 2;
}

/// Cuts across the longest edge; returns its length before.
double halve(const Triangle& t, Triangle& a, Triangle& b) {
    int longest = 0;
    double length = -1;
    for (int k = 0; k < 3; ++k) {
        const double d = squared_distance(t[k], t[(k + 1) % 3]);
        if (d > length) length = d, longest = k;
    }
    const Point3 &p = t[longest], &q = t[(longest + 1) % 3], &o = t[(longest + 2) % 3];
    const Point3 m{(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2};
    a = {p, m, o};
    b = {m, q, o};
    return std::sqrt(length);
}

double longest_edge(const Triangle& t) {
    return std::sqrt(
        std::max({squared_distance(t[0], t[1]), squared_distance(t[1], t[2]), squared_distance(t[2], t[0])}));
}

template <class F>
void split_to(const Triangle& t, double edge, F&& f) {
    Triangle a, b;
    if (halve(t, a, b) <= edge) {
        f(t);
        return;
    }
    split_to(a, edge, f);
    split_to(b, edge, f);
}

/// Areas of a piece, or of all pieces of a facet.
struct Areas {
    double all = 0, reached = 0, undercut = 0;
    void add(const Areas& a) { all += a.all, reached += a.reached, undercut += a.undercut; }
};

struct Item {
    std::uint32_t facet = 0;
    Point3 normal{};
};

/// What is to be machined: facets cut to the layer, in the order of a space-filling curve, and their facets.
struct Work {
    std::vector<Item> items;
    std::vector<Piece> pieces;
    double undercut = 0;  ///< of facets that face down
};

/// What of a facet lies between two heights: up to four triangles.
std::vector<Triangle> between(const Triangle& t, double low, double high) {
    std::vector<Triangle> pieces;
    // What lies above the layer's bottom is what its mirror image has below it.
    const BelowHeight under = below_height(t, high);
    for (int i = 0; i < under.n; ++i) {
        Triangle mirrored = under.t[i];
        for (Point3& p : mirrored) p[2] = -p[2];
        const BelowHeight over = below_height(mirrored, -low);
        for (int k = 0; k < over.n; ++k) {
            pieces.push_back(over.t[k]);
            for (Point3& p : pieces.back()) p[2] = -p[2];
        }
    }
    return pieces;
}

Work collect(Context& context, const FacetScene& scene, double low, double high) {
    struct Part {
        std::vector<Item> items;
        std::vector<Piece> pieces;
        double undercut = 0;
    };
    constexpr std::size_t grain = std::size_t{1} << 13;
    const std::size_t n = scene.mesh().size();
    std::vector<Part> parts((n + grain - 1) / grain);
    const double down = -std::sin(kUpright);
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        Part& part = parts[begin / grain];
        for (std::size_t f = begin; f < end; ++f) {
            const Triangle t = scene.triangle(static_cast<std::uint32_t>(f));
            const auto [z0, z1] = std::minmax({t[0][2], t[1][2], t[2][2]});
            if (z0 >= high || z1 <= low) continue;
            const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
            const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
            const Point3 w{uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
            const double length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
            if (!(length > 0)) continue;
            const std::vector<Triangle> pieces = between(t, low, high);
            const Point3 normal{w[0] / length, w[1] / length, w[2] / length};
            if (normal[2] < down) {
                for (const Triangle& piece : pieces) part.undercut += area_of(piece);
                continue;
            }
            const auto item = static_cast<std::uint32_t>(part.items.size());
            bool any = false;
            for (const Triangle& piece : pieces)
                if (area_of(piece) > 0) {
                    part.pieces.push_back({piece, item});
                    any = true;
                }
            if (any) part.items.push_back({static_cast<std::uint32_t>(f), normal});
        }
    });
    Work work;
    struct Key {
        std::uint64_t code;
        std::uint32_t part, index;
    };
    std::vector<Key> keys;
    std::size_t items = 0, pieces = 0;
    for (const Part& part : parts) items += part.items.size(), pieces += part.pieces.size();
    work.items.reserve(items);
    work.pieces.reserve(pieces);
    keys.reserve(pieces);
    const MortonGrid grid(scene.box());
    for (std::size_t p = 0; p < parts.size(); ++p) {
        Part& part = parts[p];
        const auto first = static_cast<std::uint32_t>(work.items.size());
        for (std::size_t i = 0; i < part.pieces.size(); ++i) {
            Piece& piece = part.pieces[i];
            piece.item += first;
            auto middle = [&](int k) { return (piece.t[0][k] + piece.t[1][k] + piece.t[2][k]) / 3; };
            keys.push_back({grid.code(middle(0), middle(1), middle(2)), static_cast<std::uint32_t>(p),
                            static_cast<std::uint32_t>(i)});
        }
        work.items.insert(work.items.end(), part.items.begin(), part.items.end());
        work.undercut += part.undercut;
    }
    parallel_sort(context, keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        if (a.code != b.code) return a.code < b.code;
        return a.part != b.part ? a.part < b.part : a.index < b.index;
    });
    for (const Key& key : keys) work.pieces.push_back(parts[key.part].pieces[key.index]);
    return work;
}

/// Of points that are tested together.
struct Tally {
    int points = 0, reached = 0, undercut = 0;
    [[nodiscard]] bool agree() const {
        return reached == points || undercut == points || (reached == 0 && undercut == 0);
    }
    [[nodiscard]] Areas share(double area) const {
        const double each = area / points;
        return {each * (points - undercut), each * reached, each * undercut};
    }
};

void add_point(Tally& tally, ReachSearcher& searcher, const ReachQuestion& q, const Point3& p,
               const Point3& n, const Point3& corner = {}, double around = 0) {
    ++tally.points;
    if (q.overhangs) {
        ++searcher.counts().rays;
        const double off = q.options.tolerance;
        if (q.scene->overhung({p[0] + off * n[0], p[1] + off * n[1], p[2] + off * n[2]}, q.top)) {
            ++tally.undercut;
            return;
        }
    }
    if (searcher.reaches(p, n, corner, around)) ++tally.reached;
}

Point3 mixed(const Triangle& t, double a, double b, double c) {
    Point3 p;
    for (int k = 0; k < 3; ++k) p[k] = a * t[0][k] + b * t[1][k] + c * t[2][k];
    return p;
}
Point3 middle_of(const Triangle& t) { return mixed(t, 1.0 / 3, 1.0 / 3, 1.0 / 3); }
/// The k-th of points that fill a triangle evenly: the R2 sequence (Roberts), folded over the diagonal.
Point3 scattered(const Triangle& t, std::size_t k) {
    constexpr double first = 0.7548776662466927, second = 0.5698402909980532;  // 1/g, 1/g²: g³ = g + 1
    double u = std::fmod(0.5 + static_cast<double>(k) * first, 1.0),
           v = std::fmod(0.5 + static_cast<double>(k) * second, 1.0);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return mixed(t, 1 - u - v, u, v);
}

/// Tests a piece at its middle and just within its corners.
Areas measure(ReachSearcher& searcher, const ReachQuestion& q, const Piece& piece, const Point3& n,
              bool& agree) {
    Tally tally;
    const Point3 middle = middle_of(piece.t);
    add_point(tally, searcher, q, middle, n);
    if (!q.overhangs && tally.reached == 0) {
        double around2 = 0;
        for (const Point3& corner : piece.t) around2 = std::max(around2, squared_distance(corner, middle));
        searcher.try_proving_missed(middle, n, std::sqrt(around2));
    }
    for (int k = 0; k < 3; ++k) {
        std::array<double, 3> w{kInset / 2, kInset / 2, kInset / 2};
        w[k] = 1 - kInset;
        const Point3 p = mixed(piece.t, w[0], w[1], w[2]);
        add_point(tally, searcher, q, p, n, piece.t[k], kShared * std::sqrt(squared_distance(p, piece.t[k])));
    }
    agree = tally.agree();
    return tally.share(area_of(piece.t));
}

/// What a run over pieces found.
struct Outcome {
    std::vector<std::pair<std::uint32_t, Areas>> decided;  ///< by item
    std::vector<Piece> border;
    std::vector<Areas> shares;  ///< of the border's pieces
    /// Areas of small pieces that were tested together and disagree, and their squares.
    double mixed = 0, mixed2 = 0;
    ReachCounts counts;

    void decide(std::uint32_t item, const Areas& areas) {
        if (!decided.empty() && decided.back().first == item) decided.back().second.add(areas);
        else decided.emplace_back(item, areas);
    }
};

/// The reached area of a layer: pieces on whose points a tool's reach disagrees are halved, level by level,
/// so that the share of area on a border is known when it is decided whether to go on.
class AreaSearch {
public:
    AreaSearch(Context& context, const FacetScene& scene, const ReachQuestion& question, double low,
               double high)
        : context_(context),
          question_(question),
          options_(question.options),
          work_(collect(context, scene, low, high)) {
        spacing_ = options_.spacing;
        if (spacing_ == 0) {
            double surface = 0;
            for (const Piece& piece : work_.pieces) surface += area_of(piece.t);
            spacing_ = std::max(1.0, std::sqrt(surface) / 50);
        }
        constexpr double tasks_per_edge =
            16;  // pieces of a large facet that are handed out as one, by length
        const double longest = spacing_ * tasks_per_edge;
        if (std::any_of(work_.pieces.begin(), work_.pieces.end(),
                        [&](const Piece& piece) { return longest_edge(piece.t) > longest; })) {
            std::vector<Piece> tasks;
            for (const Piece& piece : work_.pieces)
                split_to(piece.t, longest, [&](const Triangle& t) { tasks.push_back({t, piece.item}); });
            work_.pieces.swap(tasks);
        }
        of_item_.resize(work_.items.size());
        small_ = options_.shares ? 0 : spacing_ * spacing_ / 2;
    }

    Accessibility run(std::size_t facets) {
        if (options_.limit > 0 && !options_.shares)
            for (const std::size_t points : kPolls)
                if (const std::optional<Accessibility> sure = poll(points)) return *sure;
        std::vector<Piece> border = std::move(work_.pieces);
        std::vector<Areas> shares;
        double total = 0, on_border = 0, disagreeing = 0, disagreeing2 = 0, error = 0;
        for (int level = 0; level < kMostLevels && !border.empty(); ++level) {
            std::vector<Outcome> outcomes = test(border, level == 0);
            border.clear();
            shares.clear();
            on_border = 0;
            double squares = 0;
            for (Outcome& outcome : outcomes) {
                for (const auto& [item, areas] : outcome.decided) {
                    of_item_[item].add(areas);
                    total += areas.all;
                }
                for (const Areas& areas : outcome.shares) {
                    const double area = areas.all + areas.undercut;
                    on_border += area;
                    squares += area * area;
                }
                border.insert(border.end(), outcome.border.begin(), outcome.border.end());
                shares.insert(shares.end(), outcome.shares.begin(), outcome.shares.end());
                disagreeing += outcome.mixed;
                disagreeing2 += outcome.mixed2;
                counts_.add(outcome.counts);
            }
            error = std::sqrt(squares + disagreeing2) / 2;
            if (error <= options_.accuracy * (total + on_border) || squares <= disagreeing2) break;
            if (options_.limit > 0 && surely_decided(shares, error)) break;
        }
        for (std::size_t i = 0; i < border.size(); ++i) of_item_[border[i].item].add(shares[i]);
        Accessibility found = result(facets, on_border + disagreeing);
        if (found.area > 0) found.likely_error = error / found.area;
        return found;
    }

private:
    std::vector<Outcome> test(const std::vector<Piece>& pieces, bool whole) {
        std::vector<Outcome> outcomes((pieces.size() + kPiecesAtOnce - 1) / kPiecesAtOnce);
        parallel_for(context_, pieces.size(), kPiecesAtOnce, [&](std::size_t begin, std::size_t end) {
            Outcome& outcome = outcomes[begin / kPiecesAtOnce];
            ReachSearcher searcher(question_);
            const std::span<const Piece> these(pieces.data() + begin, end - begin);
            if (whole) test_whole(these, searcher, outcome);
            else test_quarters(these, searcher, outcome);
            outcome.counts = searcher.counts();
        });
        context_.throw_if_cancelled();
        return outcomes;
    }
    void test_one(const Piece& piece, ReachSearcher& searcher, Outcome& outcome) {
        if (context_.cancelled()) return;
        bool agree = false;
        const Areas areas = measure(searcher, question_, piece, work_.items[piece.item].normal, agree);
        if (agree) {
            outcome.decide(piece.item, areas);
        } else {
            outcome.border.push_back(piece);
            outcome.shares.push_back(areas);
        }
    }
    void test_quarters(std::span<const Piece> pieces, ReachSearcher& searcher, Outcome& outcome) {
        for (const Piece& piece : pieces) {
            if (context_.cancelled()) return;
            Triangle half[2], quarter[2];
            halve(piece.t, half[0], half[1]);
            for (const Triangle& h : half) {
                halve(h, quarter[0], quarter[1]);
                test_one({quarter[0], piece.item}, searcher, outcome);
                test_one({quarter[1], piece.item}, searcher, outcome);
            }
        }
    }
    void test_whole(std::span<const Piece> pieces, ReachSearcher& searcher, Outcome& outcome) {
        // Small pieces that follow one another are near to each other; four of them stand for all.
        std::size_t first = 0;
        double gathered = 0;
        const auto together = [&](std::size_t last) {
            if (first < last && gathered > 0)
                test_few(pieces.subspan(first, last - first), gathered, searcher, outcome);
            gathered = 0;
        };
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            if (context_.cancelled()) return;
            const Piece& piece = pieces[i];
            const double area = area_of(piece.t);
            if (area < small_ && longest_edge(piece.t) <= spacing_) {
                if (gathered == 0) first = i;
                gathered += area;
                if (gathered >= small_) together(i + 1);
                continue;
            }
            together(i);
            split_to(piece.t, spacing_, [&](const Triangle& t) {
                test_one({t, piece.item}, searcher, outcome);
            });
        }
        together(pieces.size());
    }
    void test_few(std::span<const Piece> pieces, double area, ReachSearcher& searcher, Outcome& outcome) {
        Tally tally;
        const std::size_t count = pieces.size(), points = std::min<std::size_t>(4, count);
        for (std::size_t k = 0; k < points; ++k) {
            const Piece& piece = pieces[(2 * k + 1) * count / (2 * points)];
            add_point(tally, searcher, question_, middle_of(piece.t), work_.items[piece.item].normal);
        }
        outcome.decide(pieces.front().item, tally.share(area));
        if (!tally.agree()) outcome.mixed += area, outcome.mixed2 += area * area;
    }

    /// Whether the reached share lies on one side of the limit, whatever becomes of the border.
    [[nodiscard]] bool surely_decided(const std::vector<Areas>& shares, double error) const {
        Areas sum;
        for (const Areas& areas : of_item_) sum.add(areas);
        for (const Areas& areas : shares) sum.add(areas);
        return std::abs(sum.reached - options_.limit * sum.all) > kSurely * error;
    }

    /// Points dealt evenly over the surface, by area along the space-filling curve: what they find, where it
    /// decides about the limit or is as accurate as is asked for. Not where the surface, piece by piece,
    /// takes hardly more points.
    [[nodiscard]] std::optional<Accessibility> poll(std::size_t points) {
        std::vector<double> up_to;  // mm², of the pieces as they follow one another
        up_to.reserve(work_.pieces.size());
        double surface = 0;
        for (const Piece& piece : work_.pieces) up_to.push_back(surface += area_of(piece.t));
        if (kPointsASquare * surface < static_cast<double>(points) * spacing_ * spacing_) return std::nullopt;
        std::vector<std::pair<Tally, ReachCounts>> found((points + kPointsAtOnce - 1) / kPointsAtOnce);
        parallel_for(context_, points, kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
            auto& [tally, counts] = found[begin / kPointsAtOnce];
            ReachSearcher searcher(question_);
            for (std::size_t k = begin; k < end && !context_.cancelled(); ++k) {
                const double at = (static_cast<double>(k) + 0.5) / static_cast<double>(points) * surface;
                const auto here = std::upper_bound(up_to.begin(), std::prev(up_to.end()), at);
                const Piece& piece = work_.pieces[static_cast<std::size_t>(here - up_to.begin())];
                add_point(tally, searcher, question_, scattered(piece.t, k), work_.items[piece.item].normal);
            }
            counts = searcher.counts();
        });
        context_.throw_if_cancelled();
        Tally all;
        for (const auto& [tally, counts] : found) {
            all.points += tally.points;
            all.reached += tally.reached;
            all.undercut += tally.undercut;
            counts_.add(counts);
        }
        // Agresti and Coull: two more of either kind, so that even where all agree some doubt is left.
        const double asked = all.points - all.undercut, share = (all.reached + 2) / (asked + 4),
                     error = std::sqrt(share * (1 - share) / (asked + 4));
        if (asked == 0) return std::nullopt;
        const bool decided = std::abs(all.reached / asked - options_.limit) > kSurely * error;
        if (!decided && error > options_.accuracy) return std::nullopt;
        Accessibility sure;
        const double each = surface / all.points;
        sure.area = sure.uncertain = each * asked;
        sure.reached = each * all.reached;
        sure.undercut = work_.undercut + each * all.undercut;
        sure.likely_error = error;
        count(sure);
        return sure;
    }

    void count(Accessibility& result) const {
        result.points = counts_.points;
        result.queries = counts_.queries;
        result.rays = counts_.rays;
        result.undecided = counts_.undecided;
    }

    [[nodiscard]] Accessibility result(std::size_t facets, double uncertain) const {
        Accessibility result;
        result.undercut = work_.undercut;
        result.uncertain = uncertain;
        if (options_.shares) result.share.assign(facets, -1.0f);
        for (std::size_t i = 0; i < of_item_.size(); ++i) {
            const Areas& a = of_item_[i];
            result.area += a.all;
            result.reached += a.reached;
            result.undercut += a.undercut;
            if (options_.shares && a.all > 0)
                result.share[work_.items[i].facet] = static_cast<float>(std::min(1.0, a.reached / a.all));
        }
        count(result);
        return result;
    }

    Context& context_;
    const ReachQuestion& question_;
    const AccessOptions& options_;
    Work work_;
    double spacing_ = 0, small_ = 0;  // mm, between points; mm², pieces that are tested together
    std::vector<Areas> of_item_;
    ReachCounts counts_;
};

}  // namespace

struct AccessScene::Impl {
    Impl(Context& context, MeshView mesh) : scene(context, mesh) {}
    FacetScene scene;
};

AccessScene::AccessScene(Context& context, MeshView mesh) : impl_(std::make_unique<Impl>(context, mesh)) {}

AccessScene::~AccessScene() = default;

bool AccessScene::reaches(double z_high, const Point3& point, const Point3& normal, const ToolShape& tool,
                          const AccessOptions& options) const {
    const ReachQuestion question = reach_question(impl_->scene, point[2], z_high, tool, options);
    return ReachSearcher(question).reaches(point, normal);
}

Accessibility AccessScene::accessible(Context& context, double z_low, double z_high, const ToolShape& tool,
                                      const AccessOptions& options) const {
    const ReachQuestion question = reach_question(impl_->scene, z_low, z_high, tool, options);
    return AreaSearch(context, impl_->scene, question, z_low + kTopSheet, z_high - kTopSheet)
        .run(impl_->scene.mesh().size());
}

Accessibility accessible(Context& context, MeshView mesh, double z_low, double z_high, const ToolShape& tool,
                         const AccessOptions& options) {
    return AccessScene(context, mesh).accessible(context, z_low, z_high, tool, options);
}

}  // namespace slabwright
