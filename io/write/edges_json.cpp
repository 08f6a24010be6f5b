#include "io/write/edges_json.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabwright {

namespace {

using Shape = JsonText::Shape;

constexpr std::size_t kListed = 50;

struct EdgeSum {
    std::size_t chains = 0, closed = 0;
    double length_mm = 0;
};

EdgeSum sum_of(std::span<const EdgeChain> chains, bool convex) {
    EdgeSum sum;
    for (const EdgeChain& c : chains) {
        if (c.convex != convex) continue;
        ++sum.chains;
        sum.closed += c.closed ? 1 : 0;
        sum.length_mm += c.length_mm;
    }
    return sum;
}

void put_sum(JsonText& json, const char* key, const EdgeSum& sum) {
    json.key(key).begin_object(Shape::line).key("chains").count(sum.chains).key("closed").count(sum.closed);
    json.key("length").rounded(sum.length_mm, 3).end();
}

std::string words(const EdgeSum& sum, const char* kind) {
    return fmt::format("{:.0f} mm {} in {} {} ({} closed)", sum.length_mm, kind, sum.chains,
                       sum.chains == 1 ? "chain" : "chains", sum.closed);
}

}  // namespace

void put_edges(JsonText& json, std::span<const EdgeChain> chains, double least_deg) {
    json.begin_object().key("limit_deg").rounded(least_deg, 6);
    put_sum(json, "convex", sum_of(chains, true));
    put_sum(json, "concave", sum_of(chains, false));
    json.key("longest").begin_array();
    for (const EdgeChain& c : chains.first(std::min(kListed, chains.size()))) {
        json.begin_object(Shape::line).key("convex").boolean(c.convex).key("closed").boolean(c.closed);
        json.key("length").rounded(c.length_mm, 3).key("edges");
        json.count(c.closed ? c.vertices.size() : c.vertices.size() - 1);
        json.key("sharpest_deg").rounded(c.sharpest_deg, 2).key("where").begin_array();
        for (const double x : c.at) json.rounded(x, 3);
        json.end().end();
    }
    json.end().end();
}

std::string edges_text(std::span<const EdgeChain> chains, double least_deg) {
    if (chains.empty()) return {};
    return fmt::format("  edges       that turn by {:g} deg: {}, {}\n", least_deg,
                       words(sum_of(chains, true), "convex"), words(sum_of(chains, false), "concave"));
}

}  // namespace slabwright
