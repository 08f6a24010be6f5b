#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "engine/layers/rules.h"
#include "kernels/errors.h"
#include "kernels/mesh/report.h"

namespace slabwright {

Ticks to_ticks(double mm) { return std::llround(mm * kTicksPerMm); }

namespace {

double mm_of(Ticks ticks) { return static_cast<double>(ticks) / kTicksPerMm; }

constexpr Ticks kOneJoint = 100'000;  // 0.01 mm: down-facing flats this near are made by one boundary
constexpr double kAreaUnits = 1e3, kQUnits = 1e9;
// A peak is a point and has no area; breaking it still breaks something.
constexpr double kLeastArea = 1.0;  // mm²

std::int64_t weight_of(const Feature& f) { return std::llround(std::max(f.area, kLeastArea) * kAreaUnits); }

std::vector<std::int64_t> running_sums(const std::vector<Level>& levels) {
    std::vector<std::int64_t> sums{0};
    for (const Level& l : levels) sums.push_back(sums.back() + l.weight);
    return sums;
}

// Sum of the weights of levels in [from, to].
std::int64_t weight_between(const std::vector<Level>& levels, const std::vector<std::int64_t>& sums,
                            Ticks from, Ticks to) {
    if (from > to) return 0;
    const auto first =
        std::lower_bound(levels.begin(), levels.end(), from, [](const Level& l, Ticks z) { return l.z < z; });
    const auto last =
        std::upper_bound(levels.begin(), levels.end(), to, [](Ticks z, const Level& l) { return z < l.z; });
    return sums[static_cast<std::size_t>(last - levels.begin())] -
           sums[static_cast<std::size_t>(first - levels.begin())];
}

std::int64_t weight_up_to(const std::vector<std::pair<Ticks, std::int64_t>>& ends, Ticks z) {
    const auto it =
        std::upper_bound(ends.begin(), ends.end(), z, [](Ticks t, const auto& e) { return t < e.first; });
    return it == ends.begin() ? 0 : std::prev(it)->second;
}

std::string feature_words(FeatureType type) {
    switch (type) {
        case FeatureType::peak:
            return "the peak";
        case FeatureType::valley:
            return "the valley";
        case FeatureType::up_flat:
            return "the up-facing flat";
        case FeatureType::down_flat:
            return "the down-facing flat";
        case FeatureType::saddle:
            return "the saddle";
        case FeatureType::shallow:
            return "the shallow slope";
        case FeatureType::undercut:
            return "the undercut";
    }
    return "the feature";
}

void check(const LayerRequest& r) {
    auto fail = [](const std::string& what, const std::string& remedy) {
        throw Error(ErrorKind::usage, "layers.request", what, {}, remedy);
    };
    if (!(r.height > 0) || !std::isfinite(r.height) || r.height > 1e6)
        fail("the pattern's height is not a usable length", "check the mesh and its units");
    if (!(r.max_layer > mm_of(kSame)) || !std::isfinite(r.max_layer) || r.max_layer > 1e6)
        fail("no layer can be cut: the tallest is " + words_mm(r.max_layer) + " mm",
             "use thicker slabs, a longer flute or a smaller facing allowance");
    if (r.height / r.max_layer > 1e6) fail("more than a million layers", "use thicker slabs");
    if (!(r.min_material >= 0) || !(r.min_material <= 1e6))
        fail("the minimum material thickness is not a length", "give a value from 0");
    if (!(r.min_layer >= 0) || !(r.min_layer <= 1e6))
        fail("the minimum layer thickness is not a length", "give a value from 0");
    if (!(r.facing_allowance >= 0) || !(r.facing_allowance <= 1e6))
        fail("the facing allowance is not a length", "give a value from 0");
    if (!std::isfinite(r.alpha) || !std::isfinite(r.beta))
        fail("alpha or beta is not a number", "give finite values");
    for (const double s : r.slab_thicknesses)
        if (!(s > 0) || !std::isfinite(s) || (r.max_layer + r.facing_allowance) / s > 1000)
            fail("a slab thickness of " + words_mm(s) + " mm is unusable",
                 "give thicknesses near the layers'");
    for (const Feature& f : r.features)
        if (!std::isfinite(f.z_low) || !std::isfinite(f.z_high) || !(f.area >= 0) || !std::isfinite(f.area) ||
            std::abs(f.z_low) > 1e7 || std::abs(f.z_high) > 1e7 || f.area > 1e11)
            fail("a feature has no usable height or area", "check the mesh");
}

}  // namespace

std::string words_mm(double mm) {
    std::array<char, 64> text{};
    const auto end =
        std::to_chars(text.data(), text.data() + text.size(), mm, std::chars_format::fixed, 3).ptr;
    std::string words(text.data(), end);
    if (words.find('.') != std::string::npos) {
        while (words.back() == '0') words.pop_back();
        if (words.back() == '.') words.pop_back();
    }
    return words == "-0" ? "0" : words;
}

CostUnits& CostUnits::operator+=(const CostUnits& o) {
    broken_type2 += o.broken_type2;
    broken_type1 += o.broken_type1;
    thin_layers += o.thin_layers;
    exposed_glue += o.exposed_glue;
    broken_type3 += o.broken_type3;
    layers += o.layers;
    wood += o.wood;
    minus_q += o.minus_q;
    return *this;
}

LayerCost CostUnits::in_mm() const {
    auto area = [](std::int64_t units) { return static_cast<double>(units) / kAreaUnits; };
    return {area(broken_type2),
            area(broken_type1),
            static_cast<int>(thin_layers),
            area(exposed_glue),
            area(broken_type3),
            static_cast<int>(layers),
            mm_of(wood),
            static_cast<double>(minus_q) / kQUnits};
}

LayerRules::LayerRules(const LayerRequest& request) : request_(request) {
    check(request);
    height_ = to_ticks(request.height);
    max_layer_ = to_ticks(request.max_layer);
    min_layer_ = to_ticks(request.min_layer);
    min_material_ = to_ticks(request.min_material);
    std::vector<Level> down;
    const Ticks base = to_ticks(kBaseFlatness),
                one_joint = std::max(kOneJoint, to_ticks(request.filled_underside));
    for (std::size_t i = 0; i < request.features.size(); ++i) {
        const Feature& f = request.features[i];
        const Ticks low = to_ticks(f.z_low), high = to_ticks(f.z_high);
        switch (f.type) {
            case FeatureType::saddle:
                if (!request.saddles_constrain) break;
                [[fallthrough]];
            case FeatureType::peak:
            case FeatureType::valley:
            case FeatureType::up_flat:
                if (low <= base || low > height_ + kSame) break;
                type1_.push_back({low, weight_of(f), i});
                if (f.type == FeatureType::up_flat)
                    up_flats_.push_back({low, std::llround(f.area * kAreaUnits), i});
                break;
            case FeatureType::down_flat:
                if (low > std::max(base, one_joint) && low < height_ - kSame)
                    down.push_back({low, weight_of(f), i});
                break;
            case FeatureType::shallow:
                if (high - low > 2 * kSame && high > kSame && low < height_ - kSame)
                    type3_.push_back({low, high, weight_of(f), i});
                break;
            case FeatureType::undercut:
                break;
        }
    }
    auto by_height = [](const Level& a, const Level& b) {
        return a.z != b.z ? a.z < b.z : a.feature < b.feature;
    };
    std::sort(type1_.begin(), type1_.end(), by_height);
    std::sort(up_flats_.begin(), up_flats_.end(), by_height);
    std::sort(down.begin(), down.end(), by_height);
    // One boundary makes all flats of about one height, at the lowest of them, and the board those just above
    // the base: under those that are higher a sheet of wood stays, too thin to matter.
    for (const Level& l : down)
        if (type2_.empty() || l.z - type2_.back().z > one_joint) type2_.push_back(l);
        else type2_.back().weight += l.weight;
    std::sort(type3_.begin(), type3_.end(), [](const Range& a, const Range& b) {
        return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.feature < b.feature;
    });
    type1_sums_ = running_sums(type1_);
    type2_sums_ = running_sums(type2_);
    up_flat_sums_ = running_sums(up_flats_);
    std::int64_t sum = 0;
    for (const Range& r : type3_) lows_.emplace_back(r.low, sum += r.weight);
    for (const Range& r : type3_) highs_.emplace_back(r.high, r.weight);
    std::sort(highs_.begin(), highs_.end());
    sum = 0;
    for (auto& [z, weight] : highs_) weight = sum += weight;

    // A class ends where a layer stops being thin, where the next slab is needed, and at the tallest layer.
    const Ticks tallest = max_layer_ + kSame;
    std::vector<Ticks> limits{tallest};
    if (min_layer_ > kSame) limits.push_back(min_layer_ - kSame - 1);
    const Ticks allowance = to_ticks(request.facing_allowance);
    for (const double s : request.slab_thicknesses) {
        limits.push_back(to_ticks(s) + kSame - allowance);
        thickest_ = std::max(thickest_, to_ticks(s));
    }
    // Of slabs bonded into one, a class also ends where one more joint lies within the layer, and where the
    // wood over that is no longer thin.
    if (thickest_ > 0)
        for (Ticks stack = 2 * thickest_; stack - thickest_ + kSame - allowance < tallest;
             stack += thickest_) {
            limits.push_back(stack + kSame - allowance);
            limits.push_back(stack - thickest_ + kSame);
            if (min_layer_ > kSame) limits.push_back(stack - thickest_ + min_layer_ - kSame - 1);
        }
    std::erase_if(limits, [&](Ticks l) { return l <= 0 || l > tallest; });
    std::sort(limits.begin(), limits.end());
    limits.erase(std::unique(limits.begin(), limits.end()), limits.end());
    class_limits_ = limits;
    for (const Ticks l : class_limits_) {
        CostUnits c;
        c.layers = 1;
        c.thin_layers = l < min_layer_ - kSame;
        c.wood = to_ticks(slab_for(mm_of(l)));
        class_joints_.push_back(slab_joints(0, l));
        if (!class_joints_.back().empty() && l - class_joints_.back().back() < min_layer_ - kSame)
            c.thin_layers = 1;
        class_costs_.push_back(c);
    }
    class_costs_.emplace_back();
}

double LayerRules::slab_for(double thickness_mm) const {
    // One tolerance on both sides of every limit: a class's thickest layer must find the class's slab.
    const Ticks need = to_ticks(thickness_mm) + to_ticks(request_.facing_allowance) - kSame;
    double best = 0, thickest = 0;
    for (const double s : request_.slab_thicknesses) {
        thickest = std::max(thickest, s);
        if (to_ticks(s) >= need && (best == 0 || s < best)) best = s;
    }
    if (best > 0) return best;
    if (thickest == 0)
        return request_.max_layer +
               request_.facing_allowance;  // no stock named: slabs made to fit the tallest layer
    const Ticks slabs = (need + to_ticks(thickest) - 1) / to_ticks(thickest);
    return thickest * static_cast<double>(slabs);
}

std::vector<Ticks> LayerRules::slab_joints(Ticks bottom, Ticks top) const {
    std::vector<Ticks> joints;
    if (thickest_ == 0) return joints;
    const Ticks stack = to_ticks(slab_for(mm_of(top - bottom)));
    for (Ticks z = thickest_; z + kSame < stack && z < top - bottom - kSame; z += thickest_)
        joints.push_back(bottom + z);
    return joints;
}

CostUnits LayerRules::slab_joints_cost(Ticks bottom, std::size_t c) const {
    CostUnits cost;
    if (c < class_joints_.size())
        for (const Ticks z : class_joints_[c]) cost += joint(bottom + z);
    return cost;
}

std::size_t LayerRules::class_of(Ticks thickness) const {
    return static_cast<std::size_t>(std::lower_bound(class_limits_.begin(), class_limits_.end(), thickness) -
                                    class_limits_.begin());
}

Ticks LayerRules::min_material(Ticks z) const {
    return request_.min_material_at ? to_ticks(request_.min_material_at(mm_of(z))) : min_material_;
}

Ticks LayerRules::highest_below(Ticks h) const {
    // MTmin falls or rises slowly with height, so a few steps find where z + MTmin(z) is h; the last is taken
    // downwards.
    Ticks z = h - min_material(h);
    if (!request_.min_material_at) return z;
    for (int i = 0; i < 4 && z + min_material(z) != h; ++i) z = h - min_material(z);
    return std::min(z, h - min_material(z));
}

CostUnits LayerRules::joint(Ticks z) const {
    CostUnits c;
    const Ticks least = min_material(z);
    // Type I: z in the open region (h − MTmin, h); so h in (z, z + MTmin).
    c.broken_type1 = weight_between(type1_, type1_sums_, z + kSame + 1, z + least - kSame - 1);
    // Glue: z in the closed [h − MTmin, h].
    c.exposed_glue = weight_between(up_flats_, up_flat_sums_, z - kSame, z + least + kSame);
    c.broken_type3 = weight_up_to(lows_, z - kSame - 1) - weight_up_to(highs_, z + kSame);
    return c;
}

CostUnits LayerRules::layer(Ticks bottom, Ticks top) const {
    CostUnits c;
    const std::size_t k = class_of(top - bottom);
    if (k + 1 < classes()) c = class_cost(k);
    else {
        c.layers = 1;
        c.wood = to_ticks(slab_for(mm_of(top - bottom)));
    }
    for (const Ticks z : slab_joints(bottom, top)) c += joint(z);
    c.broken_type2 = weight_between(type2_, type2_sums_, bottom + kSame + 1, top - kSame - 1);
    return c;
}

Ticks LayerRules::above(Ticks z) const {
    const auto it = std::upper_bound(type1_.begin(), type1_.end(), z + kSame,
                                     [](Ticks t, const Level& l) { return t < l.z; });
    return (it == type1_.end() ? height_ : it->z) - z;
}

double LayerRules::section_area(Ticks z) const {
    if (!request_.section_area) return 0;
    const auto [it, fresh] = areas_.try_emplace(z, 0.0);
    if (fresh) {
        const double area = request_.section_area(mm_of(z));
        it->second = std::isfinite(area) ? area : 0;
    }
    return it->second;
}

std::int64_t LayerRules::minus_q(Ticks z) const {
    if (largest_section_ < 0) {
        // The largest of sixteen sections is large enough to scale by, and is the same for every placement.
        largest_section_ = 0;
        for (int i = 0; i < 16; ++i)
            largest_section_ = std::max(largest_section_, section_area(height_ / 16 * i));
    }
    const Ticks least = min_material(z);
    const double dt = mm_of(above(z)) / (least > 0 ? mm_of(least) : 1.0);
    const double a = largest_section_ > 0 ? section_area(z) / largest_section_ : 0;
    return -std::llround((request_.alpha * dt + request_.beta * a) * kQUnits);
}

double LayerRules::printed_q(Ticks z) const {
    return request_.alpha * mm_of(above(z)) / kInch + request_.beta * section_area(z) / (kInch * kInch);
}

CostUnits LayerRules::cost(const std::vector<double>& tops) const {
    CostUnits total;
    Ticks bottom = 0;
    for (std::size_t i = 0; i < tops.size(); ++i) {
        const Ticks top = to_ticks(tops[i]);
        total += layer(bottom, top);
        if (i + 1 < tops.size()) {
            total += joint(top);
            total.minus_q += minus_q(top);
        }
        bottom = top;
    }
    return total;
}

std::string LayerRules::below_words(Ticks z, const Level& level) const {
    const Feature& f = request_.features[level.feature];
    const std::string at = feature_words(f.type) + " at " + words_mm(f.z_low) + " mm";
    if (std::abs(level.z - z) <= kSame) return "at " + at;
    return words_mm(mm_of(level.z - z)) + " mm below " + at;
}

std::string LayerRules::describe(Ticks below, Ticks z) const {
    auto is = [](Ticks a, Ticks b) { return std::abs(a - b) <= kSame; };
    if (is(z, height_)) return "top of the pattern";
    for (const Level& l : type2_)
        if (is(l.z, z))
            return "at the down-facing flat at " + words_mm(request_.features[l.feature].z_low) + " mm";
    const Level* best =
        nullptr;  // the weightiest feature that has just its minimum thickness (or hardly more) above z
    const Ticks least = min_material(z);
    constexpr Ticks hardly = static_cast<Ticks>(0.02 * kTicksPerMm);
    for (const Level& l : type1_)
        if (l.z >= z + least - kSame && l.z <= z + least + hardly && (!best || l.weight > best->weight))
            best = &l;
    if (best) return below_words(z, *best);
    if (is(z - below, max_layer_))
        return "as high as a layer may be (" + words_mm(request_.max_layer) + " mm)";
    for (const Range& r : type3_) {
        const Feature& f = request_.features[r.feature];
        const std::string range =
            " end of the shallow slope from " + words_mm(f.z_low) + " to " + words_mm(f.z_high) + " mm";
        if (is(z, r.low)) return "at the lower" + range;
        if (is(z, r.high)) return "at the upper" + range;
    }
    const auto it = std::lower_bound(type1_.begin(), type1_.end(), z - kSame,
                                     [](const Level& l, Ticks t) { return l.z < t; });
    return it == type1_.end() ? words_mm(mm_of(height_ - z)) + " mm below the top" : below_words(z, *it);
}

namespace {

std::string others(std::size_t n, const char* what) {
    return n == 0 ? std::string{} : " and " + std::to_string(n) + " more " + what;
}

std::string square(double area) { return words_mm(area) + " mm²"; }

std::array<double, 3> place_of(const Feature& f, double z) { return {f.x, f.y, z}; }

}  // namespace

/// What a boundary, or a joint between the slabs of a layer, breaks.
void LayerRules::diagnose_joint(Ticks z, bool inner, std::vector<Diagnostic>& found) const {
    const double z_mm = mm_of(z);
    const std::string joint =
        (inner ? "the joint between slabs at " : "the boundary at ") + words_mm(z_mm) + " mm ";
    const auto first = std::upper_bound(type1_.begin(), type1_.end(), z + kSame,
                                        [](Ticks t, const Level& l) { return t < l.z; });
    const Ticks least = min_material(z);
    const auto last = std::lower_bound(first, type1_.end(), z + least - kSame,
                                       [](const Level& l, Ticks t) { return l.z < t; });
    if (first < last) {
        const auto worst =
            std::max_element(first, last, [](const Level& a, const Level& b) { return a.weight < b.weight; });
        found.push_back({Severity::warning, inner ? "joint.thin" : "layers.type1",
                         joint + "leaves less than " + words_mm(mm_of(least)) + " mm of material: it is " +
                             below_words(z, *worst) +
                             others(static_cast<std::size_t>(last - first) - 1, "features"),
                         place_of(request_.features[worst->feature], z_mm)});
    }
    const Level* flat = nullptr;
    for (auto it = std::lower_bound(up_flats_.begin(), up_flats_.end(), z - kSame,
                                    [](const Level&l, Ticks t) { return l.z < t; });
         it != up_flats_.end() && it->z <= z + kSame; ++it)
        if (!flat || it->weight > flat->weight) flat = &*it;
    if (flat)
        found.push_back({Severity::warning, "layers.exposed_glue",
                         joint + "lies at an up-facing flat of " +
                             square(request_.features[flat->feature].area) + ", which shows the glue",
                         place_of(request_.features[flat->feature], z_mm)});
    const Range* shallow = nullptr;
    std::size_t count = 0;
    for (const Range& r : type3_) {
        if (r.low >= z - kSame) break;
        if (r.high <= z + kSame) continue;
        ++count;
        if (!shallow || r.weight > shallow->weight) shallow = &r;
    }
    if (shallow) {
        const Feature& f = request_.features[shallow->feature];
        found.push_back({Severity::warning, "layers.type3",
                         joint + "lies in the shallow slope from " + words_mm(f.z_low) + " to " +
                             words_mm(f.z_high) + " mm (" + square(f.area) + ")" +
                             others(count - 1, "slopes"),
                         place_of(f, z_mm)});
    }
}

/// Says of which slabs a layer is bonded, and what the joints between them break.
void LayerRules::diagnose_slabs(Ticks bottom, Ticks top, std::vector<Diagnostic>& found) const {
    if (request_.slab_thicknesses.empty()) return;
    const double slab = slab_for(mm_of(top - bottom)),
                 thickest =
                     *std::max_element(request_.slab_thicknesses.begin(), request_.slab_thicknesses.end());
    if (!(slab > thickest)) return;
    found.push_back({Severity::note,
                     "layers.bonded",
                     "the layer up to " + words_mm(mm_of(top)) + " mm needs " +
                         words_mm(std::round(slab / thickest)) + " slabs of " + words_mm(thickest) +
                         " mm bonded into one",
                     {}});
    const std::vector<Ticks> joints = slab_joints(bottom, top);
    for (const Ticks z : joints) diagnose_joint(z, true, found);
    if (!joints.empty() && top - joints.back() < min_layer_ - kSame)
        found.push_back({Severity::warning,
                         "joint.thin",
                         "the joint between slabs at " + words_mm(mm_of(joints.back())) + " mm leaves " +
                             words_mm(mm_of(top - joints.back())) +
                             " mm of the slab over it, less than the minimum of " +
                             words_mm(request_.min_layer) + " mm",
                         {}});
}

std::vector<Diagnostic> LayerRules::diagnose(const std::vector<double>& tops) const {
    std::vector<Diagnostic> found;
    Ticks bottom = 0;
    for (std::size_t i = 0; i < tops.size(); ++i) {
        const Ticks z = to_ticks(tops[i]);
        if (z - bottom < min_layer_ - kSame)
            found.push_back({Severity::warning,
                             "layers.thin",
                             "the layer from " + words_mm(mm_of(bottom)) + " to " + words_mm(tops[i]) +
                                 " mm is thinner than the minimum of " + words_mm(request_.min_layer) +
                                 " mm: give other slabs.thicknesses, or a smaller layers.min_layer",
                             {}});
        diagnose_slabs(bottom, z, found);
        for (const Level& l : type2_)
            if (l.z > bottom + kSame && l.z < z - kSame)
                found.push_back({Severity::error, "layers.type2",
                                 "no boundary lies at the down-facing flat at " + words_mm(mm_of(l.z)) +
                                     " mm (" + square(static_cast<double>(l.weight) / kAreaUnits) + ")",
                                 place_of(request_.features[l.feature], mm_of(l.z))});
        bottom = z;
        if (i + 1 < tops.size()) diagnose_joint(z, false, found);
    }
    return found;
}

void finish_placement(const LayerRules& rules, LayerPlacement& placement) {
    std::vector<double> tops;
    double bottom = 0;
    for (Boundary& b : placement.boundaries) {
        b.slab_thickness = rules.slab_for(b.z - bottom);
        tops.push_back(bottom = b.z);
    }
    placement.cost = rules.cost(tops).in_mm();
    placement.diagnostics = rules.diagnose(tops);
}

LayerCost layer_cost(const LayerRequest& request, const std::vector<double>& tops) {
    return LayerRules(request).cost(tops).in_mm();
}

}  // namespace slabwright
