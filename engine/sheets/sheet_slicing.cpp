#include "engine/sheets/sheet_slicing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>

#include "kernels/errors.h"
#include "kernels/features/section_areas.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/slicing/silhouette.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

/// Lengths that differ by less are the same height, mm.
constexpr double kSame = 1e-4;
/// A test that is passed to this share of its tolerance is passed: sections are rounded to 0.1 µm.
constexpr double kSlack = 1e-3;

struct Extents {
    double low[2] = {0, 0}, high[2] = {0, 0};  ///< mm
};

Extents extents(std::span<const Point2> loop) {
    Point2 low = loop[0], high = loop[0];
    for (const Point2 p : loop) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    return {{to_mm(low.x), to_mm(low.y)}, {to_mm(high.x), to_mm(high.y)}};
}

double overlap(const Extents& a, const Extents& b) {
    double product = 1;
    for (int k = 0; k < 2; ++k)
        product *= std::max(0.0, std::min(a.high[k], b.high[k]) - std::max(a.low[k], b.low[k]));
    return product;
}

/// Of every loop of `a` the one of `b` of the same sense that overlaps it most; nothing where that is no
/// pairing one to one.
std::optional<std::vector<std::size_t>> pairs(const Loops& a, const Loops& b) {
    if (a.size() != b.size()) return std::nullopt;
    std::vector<std::size_t> partner(a.size());
    std::vector<bool> taken(b.size(), false);
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Extents ea = extents(a.loop(i));
        const bool is_outer = signed_area(a.loop(i)) > 0;
        double best = 0;
        std::size_t at = b.size();
        for (std::size_t j = 0; j < b.size(); ++j) {
            if (taken[j] || (signed_area(b.loop(j)) > 0) != is_outer) continue;
            const double o = overlap(ea, extents(b.loop(j)));
            if (o > best) best = o, at = j;
        }
        if (at == b.size()) return std::nullopt;
        taken[at] = true;
        partner[i] = at;
    }
    return partner;
}

/// Whether an outline turns from growing to shrinking, or back, between two steps up.
bool turns(const Loops& low, const Loops& middle, const Loops& high) {
    const auto first = pairs(low, middle), second = pairs(middle, high);
    if (!first || !second) return true;
    for (std::size_t i = 0; i < low.size(); ++i) {
        const std::size_t m = (*first)[i];
        const Extents a = extents(low.loop(i)), b = extents(middle.loop(m)),
                      c = extents(high.loop((*second)[m]));
        for (int k = 0; k < 2; ++k) {
            const auto flips = [](double one, double two) {
                return std::abs(one) > 2 * kSame && std::abs(two) > 2 * kSame && one * two < 0;
            };
            if (flips(b.low[k] - a.low[k], c.low[k] - b.low[k])) return true;
            if (flips(b.high[k] - a.high[k], c.high[k] - b.high[k])) return true;
        }
    }
    return false;
}

double thinnest(const SheetRules& rules) { return rules.thicknesses.front(); }

/// The thicknesses that make up `height` from the thickest down, as indices; the rest is less than the
/// thinnest sheet and its bond.
std::vector<int> fitted(double height, const SheetRules& rules) {
    std::vector<int> stock;
    for (int t = static_cast<int>(rules.thicknesses.size()) - 1; t >= 0; --t) {
        const double pitch = rules.thicknesses[static_cast<std::size_t>(t)] + rules.bond;
        while (height >= pitch - kSame) stock.push_back(t), height -= pitch;
    }
    return stock;
}

SheetSpan span_at(double bottom, int stock, const SheetRules& rules) {
    return {bottom, bottom + rules.thicknesses[static_cast<std::size_t>(stock)], stock};
}

std::vector<SheetSpan> uniform_stack(double height, const SheetRules& rules) {
    std::vector<SheetSpan> spans;
    for (double z = 0; z + thinnest(rules) <= height + kSame; z += thinnest(rules) + rules.bond)
        spans.push_back(span_at(z, 0, rules));
    return spans;
}

/// METHOD.md section 13, with FDFF's greedy fit.
std::vector<SheetSpan> printed_stack(Context& context, MeshView mesh, double height,
                                     const SheetRules& rules) {
    const double step = thinnest(rules) + rules.bond;
    const double most = rules.thicknesses.back() + rules.bond;
    std::vector<SheetSpan> spans;
    double z = 0;
    while (z + thinnest(rules) <= height + kSame) {
        context.throw_if_cancelled();
        std::vector<Plane> planes{{z, Side::above}};
        for (int k = 1; k * step <= most + kSame && z + k * step - rules.bond <= height + kSame; ++k)
            planes.push_back({std::min(z + k * step - rules.bond, height), Side::below});
        const std::vector<Section> sections = slice(context, mesh, planes);
        std::size_t passed = 0;
        for (std::size_t k = 1; k < sections.size(); ++k, ++passed)
            if (!printed_tests_pass(sections[0].loops, sections[k < 2 ? 0 : k - 2].loops,
                                    sections[k - 1].loops, sections[k].loops, planes[k].z - z, rules))
                break;
        const double reached = static_cast<double>(std::max<std::size_t>(passed, 1)) * step;
        for (const int stock : fitted(reached, rules)) {
            spans.push_back(span_at(z, stock, rules));
            z = spans.back().top + rules.bond;
        }
    }
    return spans;
}

/// Measures the stairs of sheets, kAtOnce of them together: their sections are in memory only until they are
/// measured, since those of all sheets that a stack might have are larger than the mesh.
class StairMeter {
public:
    StairMeter(Context& context, MeshView mesh, StairSide side, bool with_inset)
        : context_(context),
          mesh_(mesh),
          side_(side),
          with_inset_(with_inset),
          height_(bounds(mesh).max.z),
          areas_(context, mesh) {}

    /// @param take (index of the span, its stair, which may be moved away): called in the order of the spans
    template <class Take>
    void measure(std::span<const SheetSpan> spans, const Take& take) {
        for (std::size_t first = 0; first < spans.size(); first += kAtOnce) {
            const std::size_t count = std::min(kAtOnce, spans.size() - first);
            std::vector<SheetStair> stairs = measure_some(spans.subspan(first, count));
            for (std::size_t i = 0; i < count; ++i) take(first + i, stairs[i]);
        }
    }

private:
    static constexpr std::size_t kAtOnce = 32;

    /// Of a sheet's samples the k-th, at the middle of the k-th of equal parts, mm.
    [[nodiscard]] double sample_height(const SheetSpan& span, int k) const {
        return std::min(span.bottom + (k + 0.5) / kStairSamples * (span.top - span.bottom),
                        height_ - kSame / 2);
    }

    [[nodiscard]] std::vector<SheetStair> measure_some(std::span<const SheetSpan> spans) {
        cut_sections(spans);
        std::vector<SheetStair> stairs(spans.size());
        if (side_ == StairSide::outside) {
            std::vector<HeightRange> ranges;
            for (const SheetSpan& span : spans) ranges.push_back({span.bottom, std::min(span.top, height_)});
            std::vector<Loops> outlines = shadows(context_, mesh_, ranges);
            for (std::size_t i = 0; i < spans.size(); ++i) stairs[i].outline = std::move(outlines[i]);
        }
        parallel_each(context_, spans.size(), [&](std::size_t i) { measure_one(spans[i], stairs[i]); });
        return stairs;
    }

    void cut_sections(std::span<const SheetSpan> spans) {
        planes_.clear();
        sections_.clear();
        for (const SheetSpan& span : spans)
            for (int k = 0; k < kStairSamples; ++k) planes_.push_back({sample_height(span, k), Side::above});
        std::sort(planes_.begin(), planes_.end(), [](const Plane& a, const Plane& b) { return a.z < b.z; });
        planes_.erase(std::unique(planes_.begin(), planes_.end(),
                                  [](const Plane& a, const Plane& b) { return b.z - a.z < kSame / 10; }),
                      planes_.end());
        sections_ = slice(context_, mesh_, planes_);
    }

    [[nodiscard]] const Loops& section_at(double z) const {
        auto at = std::lower_bound(planes_.begin(), planes_.end(), z - kSame / 5,
                                   [](const Plane& p, double value) { return p.z < value; });
        if (at == planes_.end()) --at;
        return sections_[static_cast<std::size_t>(at - planes_.begin())].loops;
    }

    void measure_one(const SheetSpan& span, SheetStair& stair) const {
        std::vector<const Loops*> inside;
        for (int k = 0; k < kStairSamples; ++k) inside.push_back(&section_at(sample_height(span, k)));
        if (side_ == StairSide::middle) {
            stair.outline = *inside[kStairSamples / 2];
        } else if (side_ == StairSide::inside) {
            stair.outline = *inside[0];
            for (const Loops* section : inside)
                if (section != inside[0]) stair.outline = intersect(stair.outline, *section);
        }
        const double thickness = span.top - span.bottom;
        const double part = areas_.volume_between(span.bottom, std::min(span.top, height_));
        const double cut = area(stair.outline) * thickness;
        if (side_ == StairSide::outside) {
            stair.volume_mm3 = std::max(0.0, cut - part);
        } else {
            double common = 0;
            for (const Loops* section : inside)
                common += area(intersect(stair.outline, *section)) * thickness / kStairSamples;
            stair.volume_mm3 = std::max(0.0, cut + part - 2 * common);
        }
        if (!with_inset_ || stair.outline.empty()) return;
        constexpr double step = 1;
        const BorderDistance border(stair.outline);
        for (const int k : {0, kStairSamples / 2, kStairSamples - 1})
            stair.inset = std::max(stair.inset,
                                   farthest_from_border(*inside[static_cast<std::size_t>(k)], border, step));
    }

    Context& context_;
    MeshView mesh_;
    StairSide side_;
    bool with_inset_;
    double height_;
    SectionAreas areas_;
    std::vector<Plane> planes_;      ///< of the sheets that are measured now, ascending
    std::vector<Section> sections_;  ///< by plane
};

/// A stack under way in the dynamic program.
struct Reached {
    double error = std::numeric_limits<double>::infinity();
    int from = -1, stock = -1;  ///< height index and sheet below
};

bool crosses(const SheetSpan& span, double joint) {
    return joint > span.bottom + kSame && joint < span.top - kSame;
}

/// All stacks of sheets, from below. Heights are those at which a sheet may begin.
class StackSearch {
public:
    StackSearch(Context& context, MeshView mesh, double height, const SheetRules& rules)
        : context_(context), mesh_(mesh), height_(height), rules_(rules) {
        find_heights();
    }

    /// Among the stacks that leave least on top: the fewest sheets with no more than `budget` of stair, and
    /// of those the least stair; the least stair of all where none keeps to the budget.
    [[nodiscard]] std::vector<SheetSpan> best(double budget) {
        weigh();
        // found[n][h]: n sheets, the next one would begin at height h.
        std::vector<std::vector<Reached>> found{std::vector<Reached>(heights_.size())};
        found[0][0].error = 0;
        const std::size_t end = last_height(choices_);
        std::size_t least = 0;
        for (std::size_t n = 1; n <= heights_.size(); ++n) {
            found.emplace_back(heights_.size());
            bool any = false;
            for (const Choice& choice : choices_) {
                const double error = found[n - 1][choice.from].error + choice.error;
                Reached& to = found[n][choice.to];
                if (error < to.error) {
                    to = {error, static_cast<int>(choice.from), choice.stock};
                    any = true;
                }
            }
            if (!any) {
                found.pop_back();
                break;
            }
            const double error = found[n][end].error;
            if (least == 0 ? error < std::numeric_limits<double>::infinity()
                           : error < found[least][end].error)
                least = n;
            if (error <= budget * (1 + 1e-9) + 1e-6) return spans_of(found, n, end);
        }
        return spans_of(found, least, end);
    }

private:
    struct Choice {
        std::size_t from, to;
        int stock;
        double error;
    };

    /// Heights in 0.1 µm, so that sums in any order are the same height.
    void find_heights() {
        std::map<std::int64_t, bool> open{{0, true}};
        const std::int64_t top = std::llround((height_ + rules_.bond) * kUnitsPerMm);
        for (auto at = open.begin(); at != open.end(); ++at) {
            for (const double thickness : rules_.thicknesses) {
                const std::int64_t next = at->first + std::llround((thickness + rules_.bond) * kUnitsPerMm);
                if (next <= top) open.emplace(next, true);
            }
            if (open.size() > kMostSheetHeights)
                throw Error(ErrorKind::no_plan, "sheets.heights",
                            fmt::format("the thicknesses add up to more than {} heights", kMostSheetHeights),
                            "", "give fewer thicknesses, or choose the strategy printed");
        }
        for (const auto& [units, unused] : open) heights_.push_back(to_mm(units));
    }

    [[nodiscard]] std::size_t at_height(double z) const {
        const auto found = std::lower_bound(heights_.begin(), heights_.end(), z - kSame / 2);
        return found != heights_.end() && *found < z + kSame / 2
                   ? static_cast<std::size_t>(found - heights_.begin())
                   : heights_.size();
    }

    /// Every sheet at every height, as far as the part goes.
    [[nodiscard]] std::vector<Choice> all_choices() const {
        std::vector<Choice> choices;
        for (std::size_t h = 0; h < heights_.size(); ++h)
            for (int t = 0; t < static_cast<int>(rules_.thicknesses.size()); ++t) {
                const SheetSpan span = span_at(heights_[h], t, rules_);
                const std::size_t to = at_height(span.top + rules_.bond);
                if (to < heights_.size() && span.top <= height_ + kSame) choices.push_back({h, to, t, 0});
            }
        return choices;
    }

    /// Leaves out what reaches across a joint, for each joint that then still has a stack as high.
    void keep_joints(std::vector<Choice>& choices) const {
        const std::size_t highest = last_height(choices);
        for (const double joint : rules_.joints) {
            std::vector<Choice> spared;
            for (const Choice& choice : choices)
                if (!crosses(span_at(heights_[choice.from], choice.stock, rules_), joint))
                    spared.push_back(choice);
            if (last_height(spared) == highest) choices = std::move(spared);
        }
    }

    void weigh() {
        std::vector<Choice> choices = all_choices();
        keep_joints(choices);
        std::vector<SheetSpan> spans;
        for (const Choice& choice : choices)
            spans.push_back(span_at(heights_[choice.from], choice.stock, rules_));
        StairMeter meter(context_, mesh_, rules_.side, rules_.most_inset > 0);
        meter.measure(spans, [&](std::size_t i, const SheetStair& stair) {
            if (rules_.most_inset > 0 && choices[i].stock > 0 && stair.inset > rules_.most_inset) return;
            choices[i].error = stair.volume_mm3;
            choices_.push_back(choices[i]);
        });
    }

    /// The highest that a stack reaches.
    [[nodiscard]] std::size_t last_height(const std::vector<Choice>& choices) const {
        std::vector<bool> reached(heights_.size(), false);
        reached[0] = true;
        for (const Choice& choice : choices)  // ordered by where they begin
            if (reached[choice.from]) reached[choice.to] = true;
        std::size_t last = 0;
        for (std::size_t h = 0; h < reached.size(); ++h)
            if (reached[h]) last = h;
        return last;
    }

    [[nodiscard]] std::vector<SheetSpan> spans_of(const std::vector<std::vector<Reached>>& found,
                                                  std::size_t n, std::size_t end) const {
        std::vector<SheetSpan> spans;
        for (std::size_t at = end; n > 0; --n) {
            const Reached& r = found[n][at];
            at = static_cast<std::size_t>(r.from);
            spans.push_back(span_at(heights_[at], r.stock, rules_));
        }
        std::reverse(spans.begin(), spans.end());
        return spans;
    }

    Context& context_;
    MeshView mesh_;
    double height_;
    const SheetRules& rules_;
    std::vector<double> heights_;
    std::vector<Choice> choices_;
};

void require_rules(const SheetRules& rules) {
    const auto refuse = [](const char* what, const char* remedy) {
        throw Error(ErrorKind::usage, "sheets.rules", what, "", remedy);
    };
    if (rules.thicknesses.empty()) refuse("no thickness of sheets is given", "name those in stock");
    double last = 0;
    for (const double t : rules.thicknesses) {
        if (!(t > last + kSame) || !(t < 1e5))
            refuse("thicknesses of sheets must ascend from over 0", "sort them, each once");
        last = t;
    }
    if (!(rules.bond >= 0) || !(rules.bond < 1e3) || !(rules.triangle_mm2 >= 0) ||
        !(rules.area_percent >= 0) || !(rules.most_inset >= 0))
        refuse("bond and tolerances must be 0 or more", "see `slabwright sheets --help`");
    for (const double joint : rules.joints)
        if (!(joint > 0) || !(joint < 1e5)) refuse("a joint lies over 0 mm", "give heights over the foot");
}

}  // namespace

bool printed_tests_pass(const Loops& first, const Loops& before_last, const Loops& last, const Loops& other,
                        double height, const SheetRules& rules) {
    const auto partners = pairs(first, other);
    if (!partners || first.empty()) return false;
    for (std::size_t i = 0; i < first.size(); ++i) {
        const auto a = first.loop(i), b = other.loop((*partners)[i]);
        const Extents ea = extents(a), eb = extents(b);
        for (int k = 0; k < 2; ++k)
            for (const double apart : {eb.low[k] - ea.low[k], eb.high[k] - ea.high[k]})
                if (std::abs(apart) * height / 2 > rules.triangle_mm2 * (1 + kSlack)) return false;
        const double area_a = std::abs(signed_area(a)), area_b = std::abs(signed_area(b));
        if (100 * std::abs(area_b - area_a) / area_a > rules.area_percent * (1 + kSlack)) return false;
    }
    return !turns(before_last, last, other);
}

std::vector<SheetStair> stairs_of(Context& context, MeshView mesh, const std::vector<SheetSpan>& spans,
                                  StairSide side, bool with_inset) {
    std::vector<SheetStair> stairs;
    if (spans.empty()) return stairs;
    stairs.reserve(spans.size());
    StairMeter meter(context, mesh, side, with_inset);
    meter.measure(spans, [&](std::size_t, SheetStair& stair) { stairs.push_back(std::move(stair)); });
    return stairs;
}

SheetStack stack_of_sheets(Context& context, MeshView mesh, const SheetRules& rules) {
    require_rules(rules);
    const double height = bounds(mesh).max.z;
    if (thinnest(rules) > height + kSame)
        throw Error(
            ErrorKind::no_plan, "sheets.too_low",
            fmt::format("the part is {:.4g} mm high, the thinnest sheet {:.4g} mm", height, thinnest(rules)),
            "", "add a thinner sheet, or stack along another axis");
    SheetStack stack;
    if (rules.strategy == SheetStrategy::uniform) {
        stack.sheets = uniform_stack(height, rules);
    } else {
        std::optional<StackSearch> search;  // refuses before print's stack is made
        if (rules.strategy == SheetStrategy::optimal) search.emplace(context, mesh, height, rules);
        stack.sheets = printed_stack(context, mesh, height, rules);
        if (search) {
            double budget = 0;
            for (const SheetStair& stair : stairs_of(context, mesh, stack.sheets, rules.side, false))
                budget += stair.volume_mm3;
            // Higher than print's stack: what it leaves on top would be error too.
            const SectionAreas areas(context, mesh);
            budget += areas.volume_between(std::min(height, stack.sheets.back().top), height);
            const std::vector<SheetSpan> best = search->best(budget);
            if (!best.empty()) stack.sheets = best;
        }
    }
    for (const SheetStair& stair : stairs_of(context, mesh, stack.sheets, rules.side, false))
        stack.stair_mm3 += stair.volume_mm3;
    stack.left_on_top = std::max(0.0, height - stack.sheets.back().top);
    if (stack.left_on_top < kSame) stack.left_on_top = 0;
    for (const double joint : rules.joints)
        if (std::any_of(stack.sheets.begin(), stack.sheets.end(),
                        [&](const SheetSpan& span) { return crosses(span, joint); }))
            stack.missed.push_back(joint);
    return stack;
}

}  // namespace slabwright
