#include "engine/sheet_proof/hold_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "engine/sheet_proof/common_place.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

int root_in(const std::vector<int>& parents, int i) {
    while (parents[static_cast<std::size_t>(i)] != i) i = parents[static_cast<std::size_t>(i)];
    return i;
}

void join_in(std::vector<int>& parents, int a, int b) {
    a = root_in(parents, a), b = root_in(parents, b);
    parents[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
}

bool same_hole(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    constexpr double same = 1e-3;  // mm
    return std::abs(a[0] - b[0]) < same && std::abs(a[1] - b[1]) < same && std::abs(a[2] - b[2]) < same;
}

}  // namespace

ReadHold read_hold(const ReadPiece& piece) {
    ReadHold hold;
    for (const std::array<double, 8>& tab : piece.tabs) {
        for (std::size_t k = 0; k < 8; k += 2)
            hold.tabs.points.push_back({to_units(tab[k]), to_units(tab[k + 1])});
        hold.tabs.close_loop();
        const std::size_t at = hold.tabs.starts[hold.tabs.size() - 1];
        if (signed_area(hold.tabs.loop(hold.tabs.size() - 1)) < 0)
            std::reverse(hold.tabs.points.begin() + static_cast<long>(at), hold.tabs.points.end());
    }
    if (!hold.tabs.empty()) hold.tabs = unite(hold.tabs, {});
    for (const std::array<double, 3>& hole : piece.holes) {
        const double r = hole[2] / 2;
        const int n = std::max(
            16, static_cast<int>(std::ceil(std::numbers::pi / std::acos(1 - 0.002 / std::max(r, 0.01)))));
        for (int i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * i / n;
            hold.holes.points.push_back(
                {to_units(hole[0] + r * std::cos(a)), to_units(hole[1] + r * std::sin(a))});
        }
        hold.holes.close_loop();
    }
    if (!hold.holes.empty()) hold.holes = unite(hold.holes, {});
    return hold;
}

SheetBodies::SheetBodies(const ReadPiece& piece) : piece_(piece) {}

void SheetBodies::add_level(const Loops& made) {
    const Pieces parts(made);
    std::vector<int> bodies;
    const bool is_first = parents_.empty();
    for (std::size_t p = 0; p < parts.size(); ++p) {
        bodies.push_back(static_cast<int>(parents_.size()));
        parents_.push_back(bodies.back());
        const bool is_sure = parts.size() == 1 && last_.size() == 1;
        for (std::size_t q = 0; q < last_.size(); ++q)
            if (is_sure || have_common_place(parts.regions[p], last_[q]))
                join_in(parents_, bodies.back(), last_bodies_[q]);
    }
    if (is_first) {
        for (const std::array<double, 3>& hole : piece_.holes) {
            const Point2 at{to_units(hole[0]), to_units(hole[1])};
            int found = -1;
            double least = 0;
            for (std::size_t p = 0; p < parts.size(); ++p) {
                Loops outer;
                const auto loop = parts.regions[p].loop(0);
                outer.points.assign(loop.begin(), loop.end());
                outer.close_loop();
                if (winding(outer, at) > 0 && (found < 0 || area(outer) < least))
                    found = bodies[p], least = area(outer);
            }
            holes_.push_back(found);
        }
    }
    last_ = parts.regions;
    last_bodies_ = bodies;
}

std::vector<int> SheetBodies::holes() const { return holes_; }

int SheetBodies::root(int body) const { return root_in(parents_, body); }

std::vector<int> SheetBodies::roots() const {
    std::vector<int> roots;
    for (std::size_t i = 0; i < parents_.size(); ++i)
        if (parents_[i] == static_cast<int>(i)) roots.push_back(static_cast<int>(i));
    return roots;
}

PieceHold hold_of(const ReadPiece& piece, const std::string& file, const SheetBodies& bodies) {
    PieceHold hold{&piece, file, {}, {}};
    for (const int body : bodies.holes()) hold.holes.push_back(body < 0 ? -1 : bodies.root(body));
    hold.bodies = bodies.roots();
    return hold;
}

int require_held(const std::vector<PieceHold>& pieces, std::vector<Diagnostic>& violations) {
    if (std::all_of(pieces.begin(), pieces.end(),
                    [](const PieceHold& p) { return p.piece->holes.empty() && p.piece->tabs.empty(); }))
        return 0;
    std::vector<const PieceHold*> order;
    for (const PieceHold& piece : pieces) order.push_back(&piece);
    std::sort(order.begin(), order.end(),
              [](const auto* a, const auto* b) { return a->piece->low < b->piece->low; });
    // Bodies of all pieces; the last index stands for the rods beside the part.
    std::vector<std::map<int, int>> index(order.size());
    int count = 0;
    for (std::size_t i = 0; i < order.size(); ++i)
        for (const int body : order[i]->bodies) index[i][body] = count++;
    std::vector<int> parents(static_cast<std::size_t>(count) + 1);
    std::iota(parents.begin(), parents.end(), 0);
    for (std::size_t i = 0; i < order.size(); ++i) {
        const PieceHold& piece = *order[i];
        const Loops tabs = read_hold(*piece.piece).tabs;
        std::map<int, int> rods;
        for (std::size_t h = 0; h < piece.holes.size(); ++h) {
            const std::array<double, 3>& hole = piece.piece->holes[h];
            if (piece.holes[h] >= 0 && winding(tabs, {to_units(hole[0]), to_units(hole[1])}) > 0)
                ++rods[piece.holes[h]];
        }
        for (const auto& [body, n] : rods)
            if (n >= 2) join_in(parents, index[i].at(body), count);
        if (i + 1 == order.size()) continue;
        const PieceHold& next = *order[i + 1];
        std::map<std::pair<int, int>, int> shared;
        for (std::size_t h = 0; h < piece.holes.size(); ++h)
            for (std::size_t k = 0; k < next.holes.size(); ++k)
                if (piece.holes[h] >= 0 && next.holes[k] >= 0 &&
                    same_hole(piece.piece->holes[h], next.piece->holes[k]))
                    ++shared[{index[i].at(piece.holes[h]), index[i + 1].at(next.holes[k])}];
        for (const auto& [bodies, n] : shared)
            if (n >= 2) join_in(parents, bodies.first, bodies.second);
    }
    std::map<int, int> sizes;
    for (int b = 0; b < count; ++b) ++sizes[root_in(parents, b)];
    int main = 0;
    for (const auto& [root, n] : sizes)
        if (n > sizes[main]) main = root;
    int loose = 0;
    for (std::size_t i = 0; i < order.size(); ++i)
        for (const auto& [body, b] : index[i]) {
            if (root_in(parents, b) == main) continue;
            ++loose;
            violations.push_back(
                {Severity::error,
                 "sheets.hold",
                 fmt::format("{}: piece {}: an island is joined to nothing by two dowels or tabs",
                             order[i]->file, order[i]->piece->number),
                 {}});
        }
    return loose;
}

}  // namespace slabwright
