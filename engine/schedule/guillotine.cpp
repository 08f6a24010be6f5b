#include "engine/schedule/guillotine.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

namespace slabwright {

namespace {

constexpr double kSame = 1e-6;  // mm

enum class Order : std::uint8_t { area, longer, shorter, around };
enum class Fit : std::uint8_t { area, shorter, longer };
enum class Split : std::uint8_t { shorter, longer, smaller, larger };
/// Whether a piece that fits both ways is tried as it is or turned first; the first of two equal fits stays.
enum class First : std::uint8_t { as_it_is, turned };

struct Rules {
    Order order{};
    Fit fit{};
    Split split{};
    First first{};
};

double rank_of(const SawnSize& s, Order order) {
    switch (order) {
        case Order::area:
            return s.length * s.width;
        case Order::longer:
            return std::max(s.length, s.width);
        case Order::shorter:
            return std::min(s.length, s.width);
        case Order::around:
            break;
    }
    return s.length + s.width;
}

/// How well a piece fits into what is free: less is better.
std::array<double, 2> rank_of(const SawnRectangle& free, const SawnSize& s, Fit fit) {
    const double beside = free.length - s.length, above = free.width - s.width;
    const double least = std::min(beside, above), most = std::max(beside, above);
    switch (fit) {
        case Fit::area:
            return {free.mm2() - s.length * s.width, least};
        case Fit::shorter:
            return {least, most};
        case Fit::longer:
            break;
    }
    return {most, least};
}

bool fits(const SawnRectangle& free, const SawnSize& s) {
    return s.length <= free.length + kSame && s.width <= free.width + kSame;
}

SawnSize turned(const SawnSize& s) { return {s.width, s.length}; }

/// Boards under way.
class Laying {
public:
    Laying(const SawnSize& board, double kerf, const Rules& rules)
        : board_(board), kerf_(kerf), rules_(rules) {}

    void lay(std::size_t piece, const SawnSize& size) {
        std::optional<Choice> best;
        for (std::size_t b = 0; b < free_.size(); ++b)
            for (std::size_t f = 0; f < free_[b].size(); ++f) choose(best, b, f, size);
        if (!best) {
            boards_.emplace_back();
            free_.push_back({{0, 0, board_.length, board_.width}});
            choose(best, boards_.size() - 1, 0, size);
        }
        put(*best, piece, best->turned ? turned(size) : size);
    }

    std::vector<SawnBoard> take() {
        for (std::size_t b = 0; b < boards_.size(); ++b) {
            boards_[b].offcuts = std::move(free_[b]);
            std::stable_sort(
                boards_[b].offcuts.begin(), boards_[b].offcuts.end(),
                [](const SawnRectangle& a, const SawnRectangle& c) { return a.mm2() > c.mm2(); });
        }
        return std::move(boards_);
    }

private:
    struct Choice {
        std::array<double, 2> rank{};
        std::size_t board = 0, free = 0;
        bool turned = false;
    };

    void choose(std::optional<Choice>& best, std::size_t b, std::size_t f, const SawnSize& size) const {
        for (const bool turn : {rules_.first == First::turned, rules_.first != First::turned}) {
            const SawnSize as = turn ? turned(size) : size;
            if (!fits(free_[b][f], as)) continue;
            const std::array<double, 2> rank = rank_of(free_[b][f], as, rules_.fit);
            if (!best || rank < best->rank) best = Choice{rank, b, f, turn};
        }
    }

    /// Whether the first cut goes along y, so that what lies beside the piece is as wide as the whole.
    [[nodiscard]] bool cuts_along_y_first(const SawnRectangle& free, const SawnSize& s) const {
        const double beside = free.length - s.length, above = free.width - s.width;
        switch (rules_.split) {
            case Split::shorter:
                return beside > above;
            case Split::longer:
                return beside <= above;
            case Split::smaller:
                return s.length * above > beside * s.width;
            case Split::larger:
                break;
        }
        return s.length * above <= beside * s.width;
    }

    void put(const Choice& choice, std::size_t piece, const SawnSize& s) {
        SawnBoard& board = boards_[choice.board];
        std::vector<SawnRectangle>& free = free_[choice.board];
        const SawnRectangle from = free[choice.free];
        free.erase(free.begin() + static_cast<std::ptrdiff_t>(choice.free));
        const bool along_y = cuts_along_y_first(from, s);
        const auto beside = [&](double width) {  // what lies beyond the piece in x
            const double left = from.length - s.length, kerf = std::min(kerf_, left);
            if (left <= kSame) return;
            board.cuts.push_back({from.x + s.length, from.y, kerf, width});
            if (left - kerf > kSame) free.push_back({from.x + s.length + kerf, from.y, left - kerf, width});
        };
        const auto above = [&](double length) {
            const double left = from.width - s.width, kerf = std::min(kerf_, left);
            if (left <= kSame) return;
            board.cuts.push_back({from.x, from.y + s.width, length, kerf});
            if (left - kerf > kSame) free.push_back({from.x, from.y + s.width + kerf, length, left - kerf});
        };
        if (along_y) {
            beside(from.width);
            above(std::min(s.length, from.length));
        } else {
            above(from.length);
            beside(std::min(s.width, from.width));
        }
        board.pieces.push_back({piece, {from.x, from.y, s.length, s.width}, choice.turned});
    }

    const SawnSize board_;
    const double kerf_;
    const Rules rules_;
    std::vector<SawnBoard> boards_;
    std::vector<std::vector<SawnRectangle>> free_;  // of each board
};

/// Less is better.
std::tuple<std::size_t, double, std::size_t> rank_of(const std::vector<SawnBoard>& boards) {
    double largest = 0;
    std::size_t cuts = 0;
    for (const SawnBoard& board : boards) {
        if (!board.offcuts.empty()) largest = std::max(largest, board.offcuts.front().mm2());
        cuts += board.cuts.size();
    }
    return {boards.size(), -largest, cuts};
}

std::vector<SawnBoard> laid_by(std::span<const SawnSize> pieces, const SawnSize& board, double kerf,
                               const Rules& rules) {
    std::vector<std::size_t> order(pieces.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return rank_of(pieces[a], rules.order) > rank_of(pieces[b], rules.order);
    });
    Laying laying(board, kerf, rules);
    for (const std::size_t piece : order) laying.lay(piece, pieces[piece]);
    return laying.take();
}

}  // namespace

bool fits_on(const SawnSize& board, const SawnSize& piece) {
    const SawnRectangle whole{0, 0, board.length, board.width};
    return fits(whole, piece) || fits(whole, turned(piece));
}

std::vector<SawnBoard> lay_on_boards(std::span<const SawnSize> pieces, const SawnSize& board, double kerf) {
    for (const SawnSize& s : pieces)
        if (!fits_on(board, s)) return {};
    std::vector<SawnBoard> best;
    for (const Order order : {Order::area, Order::longer, Order::shorter, Order::around})
        for (const Fit fit : {Fit::area, Fit::shorter, Fit::longer})
            for (const Split split : {Split::shorter, Split::longer, Split::smaller, Split::larger})
                for (const First first : {First::as_it_is, First::turned}) {
                    std::vector<SawnBoard> laid = laid_by(pieces, board, kerf, {order, fit, split, first});
                    if (best.empty() || rank_of(laid) < rank_of(best)) best = std::move(laid);
                }
    return best;
}

}  // namespace slabwright
