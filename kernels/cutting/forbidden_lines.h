// What is forbidden on some parallel lines so far, and what is known of each while more is held against it.
// Internal to fibres: BlockOfLines adds what facets forbid.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "kernels/cutting/fibre_rows.h"
#include "kernels/cutting/fibres.h"

namespace slabwright {

// Whether all of [low, high] is forbidden on a line already; `at` remembers the interval that was looked at
// last.
inline bool covered(const std::vector<Stretch>& cover, std::uint32_t& at, double low, double high) {
    if (at < cover.size() && cover[at].low <= low && high <= cover[at].high) return true;
    const auto next = std::upper_bound(cover.begin(), cover.end(), low,
                                       [](double v, const Stretch& s) { return v < s.low; });
    if (next == cover.begin()) return false;
    at = static_cast<std::uint32_t>(next - cover.begin()) - 1;
    return high <= cover[at].high;
}

/// Makes one of intervals that meet, of such as ascend by their lower ends.
inline void join_ascending(std::vector<Forbidden>& on_line) {
    constexpr double merge_gap = 1e-6;  // mm; gaps this small are rounding between neighbouring elements
    std::size_t kept = 0;
    for (const Forbidden& f : on_line) {
        if (kept == 0 || f.low > on_line[kept - 1].high + merge_gap) {
            on_line[kept++] = f;
            continue;
        }
        Forbidden& last = on_line[kept - 1];
        if (f.high > last.high) last.high = f.high, last.nz_high = f.nz_high;
    }
    on_line.resize(kept);
}

/// What a ball forbids is kept ascending and disjoint as it is found; a flat cutter's intervals are joined in
/// the end, or when they are taken for covered.
class ForbiddenLines {
public:
    // What is forbidden in the end, line by line.
    [[nodiscard]] Fibres merged() {
        Fibres part;
        std::size_t count = 0;
        for (int l = 0; l < n_; ++l) {
            join(found_[l]);
            count += found_[l].size();
        }
        part.intervals.reserve(count);
        part.starts.reserve(static_cast<std::size_t>(n_) + 1);
        for (int l = 0; l < n_; ++l) {
            part.intervals.insert(part.intervals.end(), found_[l].begin(), found_[l].end());
            part.starts.push_back(static_cast<std::uint32_t>(part.intervals.size()));
        }
        return part;
    }

protected:
    struct LineRange {
        int first = 0, last = 0;
        [[nodiscard]] bool any() const { return first < last; }
    };
    static constexpr double kNowhere = std::numeric_limits<double>::infinity();
    static constexpr double kFarAway = 1e30;  // mm; where lines are that fill up a block's last step

    /// @param lines ascending, at most kLinesTogether
    ForbiddenLines(bool ball, double radius, std::span<const std::int32_t> lines)
        : ball_(ball), r_(radius), n_(static_cast<int>(lines.size())) {
        at_.fill(kFarAway);
        for (int l = 0; l < n_; ++l) at_[l] = to_mm(lines[static_cast<std::size_t>(l)]);
        if (n_ > 1) per_mm_ = (n_ - 1) / (at_[n_ - 1] - at_[0]);
    }

    /// Goes on below all that is forbidden so far.
    void begin_cover() {
        amid_gaps_ = false;
        cover_.low.fill(-kNowhere);
        cover_.high.fill(-kNowhere);
        cover_.next.fill(kNowhere);
        for (int l = 0; l < n_; ++l)
            if (!found_[l].empty()) cover_.next[l] = found_[l].front().low;
    }

    // As std::lower_bound among the lines, which mostly are evenly spaced.
    [[nodiscard]] int first_line_from(double v) const {
        const double guess = (v - at_[0]) * per_mm_;
        int l = guess <= 0 ? 0 : guess >= n_ ? n_ : static_cast<int>(guess);
        while (l > 0 && at_[l - 1] >= v) --l;
        while (l < n_ && at_[l] < v) ++l;
        return l;
    }

    // Makes one of intervals that meet; a disc's come in any order.
    void join(std::vector<Forbidden>& on_line) const {
        if (!ball_)
            std::sort(on_line.begin(), on_line.end(), [](const Forbidden& a, const Forbidden& b) {
                return a.low != b.low ? a.low < b.low : a.high < b.high;
            });
        join_ascending(on_line);
    }

    // Those within the radius of [low, high].
    [[nodiscard]] LineRange lines_between(double low, double high) const {
        return {first_line_from(low - r_), first_line_from(high + r_)};
    }

    // The kernels' steps that hold them.
    [[nodiscard]] static LineRange in_steps(LineRange a) {
        const int n = (a.last - a.first + kLinesStep - 1) / kLinesStep * kLinesStep,
                  first = std::min(a.first, kLinesTogether - n);
        return {first, first + n};
    }

    // Looks at the last stretch that begins no later than `low`.
    void look_at(int l, double low) {
        const std::vector<Forbidden>& on_line = found_[l];
        auto next = std::upper_bound(on_line.begin(), on_line.end(), low,
                                     [](double v, const Forbidden& f) { return v < f.low; });
        if (amid_gaps_ && next != on_line.end() &&
            (next == on_line.begin() || low >= 0.5 * (std::prev(next)->high + next->low)))
            ++next;
        look(l, next);
    }

    void look(int l, std::vector<Forbidden>::const_iterator next) {
        const std::vector<Forbidden>& on_line = found_[l];
        if (amid_gaps_) {
            const bool none = next == on_line.begin(), first = none || next - 1 == on_line.begin(),
                       last = none || next == on_line.end();
            cover_.low[l] = first ? -kNowhere : 0.5 * ((next - 2)->high + (next - 1)->low);
            cover_.high[l] = cover_.next[l] = last ? kNowhere : 0.5 * ((next - 1)->high + next->low);
            return;
        }
        cover_.next[l] = next == on_line.end() ? kNowhere : next->low;
        cover_.low[l] = next == on_line.begin() ? -kNowhere : std::prev(next)->low;
        cover_.high[l] = next == on_line.begin() ? -kNowhere : std::prev(next)->high;
    }

    // Whether [low_, high_] reaches out of what is forbidden on a line.
    [[nodiscard]] bool out(int l) {
        if (state_[l] != kLooksElsewhere) return state_[l] != 0;
        look_at(l, low_[l]);
        return high_[l] > cover_.high[l];
    }

    // Of these lines those, from the first to the last, on which [low_, high_] does.
    LineRange narrowed(LineRange lines) {
        while (lines.any() && !out(lines.first)) ++lines.first;
        while (lines.any() && !out(lines.last - 1)) --lines.last;
        return lines;
    }

    // Where [low_, high_] reaches out, looks at the stretch that its middle may lie in: a group's facets
    // mostly forbid what joins that.
    void look_amid(LineRange lines) {
        for (int l = lines.first; l < lines.last; ++l) {
            const double middle = 0.5 * (low_[l] + high_[l]);
            if (state_[l] != 0 && !(cover_.low[l] <= middle && middle < cover_.next[l])) look_at(l, middle);
        }
    }

    // Adds to what is forbidden on a line, which stays ascending and disjoint.
    void forbid(int l, const Forbidden& h) {
        if (amid_gaps_) return fill(l, h);
        std::vector<Forbidden>& on_line = found_[l];
        auto at = std::lower_bound(on_line.begin(), on_line.end(), h.low,
                                   [](const Forbidden& f, double v) { return f.high < v; });
        if (at == on_line.end() || at->low > h.high) at = on_line.insert(at, h);
        else {
            if (h.low < at->low) {
                at->low = h.low;
                at->nz_low = h.nz_low;
            }
            if (h.high > at->high) {
                at->high = h.high;
                at->nz_high = h.nz_high;
                auto beyond = at + 1;
                for (; beyond != on_line.end() && beyond->low <= h.high; ++beyond)
                    if (beyond->high > at->high) {
                        at->high = beyond->high;
                        at->nz_high = beyond->nz_high;
                    }
                if (beyond != at + 1) at = on_line.erase(at + 1, beyond) - 1;
            }
        }
        look(l, at + 1);
    }

    // A gap between what can be touched is forbidden as a whole where its middle is.
    void fill(int l, const Forbidden& h) {
        std::vector<Forbidden>& on_line = found_[l];
        std::size_t at = 0;
        while (at + 1 < on_line.size() && 0.5 * (on_line[at].high + on_line[at + 1].low) <= h.low) ++at;
        while (at + 1 < on_line.size() && 0.5 * (on_line[at].high + on_line[at + 1].low) < h.high) {
            on_line[at].high = on_line[at + 1].high;
            on_line[at].nz_high = on_line[at + 1].nz_high;
            on_line.erase(on_line.begin() + static_cast<std::ptrdiff_t>(at) + 1);
        }
        look(l, on_line.empty() ? on_line.begin() : on_line.begin() + static_cast<std::ptrdiff_t>(at) + 1);
    }

    // Takes what a disc has been found to meet so far for covered.
    void cover() {
        for (int l = 0; l < n_; ++l) {
            std::vector<Stretch>& cover = covered_[l];
            cover.clear();
            for (const Forbidden& f : found_[l]) cover.push_back({f.low, f.high});
            std::sort(cover.begin(), cover.end(),
                      [](const Stretch& a, const Stretch& b) { return a.low < b.low; });
            std::size_t kept = 0;
            for (const Stretch& s : cover)
                if (kept > 0 && s.low <= cover[kept - 1].high)
                    cover[kept - 1].high = std::max(cover[kept - 1].high, s.high);
                else cover[kept++] = s;
            cover.resize(kept);
            seen_[l] = 0;
        }
    }

    [[nodiscard]] bool is_covered(int l) {
        return low_[l] >= high_[l] || covered(covered_[l], seen_[l], low_[l], high_[l]);
    }

    // Neighbouring facets mostly follow one another, so most intervals only stretch the one before.
    void append(std::vector<Forbidden>& on_line, const Forbidden& h) {
        if (on_line.empty() || h.low > on_line.back().high || h.high < on_line.back().low) {
            on_line.push_back(h);
            return;
        }
        Forbidden& before = on_line.back();
        if (h.low < before.low) {
            before.low = h.low;
            before.nz_low = h.nz_low;
        }
        if (h.high > before.high) {
            before.high = h.high;
            before.nz_high = h.nz_high;
        }
    }

    // All ends of what is forbidden are known, and are at r from what a ball touches there: a gap at an end
    // that is nearer to something is none.
    static void close_within(std::vector<Forbidden>& on_line) {
        constexpr auto within = static_cast<float>(kWithin);
        const auto is = [](float nz) { return nz > within / 2; };
        std::size_t kept = 0;
        for (std::size_t i = 1; i < on_line.size(); ++i) {
            Forbidden& last = on_line[kept];
            if (is(last.nz_high) || is(on_line[i].nz_low))
                last.high = on_line[i].high, last.nz_high = on_line[i].nz_high;
            else on_line[++kept] = on_line[i];
        }
        if (on_line.empty()) return;
        on_line.resize(kept + 1);
        if (is(on_line.front().nz_low)) on_line.front().nz_low -= within;
        if (is(on_line.back().nz_high)) on_line.back().nz_high -= within;
    }

    const bool ball_;
    const double r_;
    const int n_;
    bool amid_gaps_ = false;  // the gaps between what can be touched are looked at, each as a whole
    double per_mm_ = 0;       // lines
    alignas(64) std::array<double, kLinesTogether> at_{}, low_{}, high_{};
    alignas(64) std::array<std::int64_t, kLinesTogether> state_{};
    std::array<std::vector<Forbidden>, kLinesTogether> found_;  // a ball's: ascending and disjoint
    CoverRows cover_;                                           // of a ball
    std::array<std::vector<Stretch>, kLinesTogether> covered_;  // of a disc: ascending and disjoint
    std::array<std::uint32_t, kLinesTogether> seen_{};
};

}  // namespace slabwright
