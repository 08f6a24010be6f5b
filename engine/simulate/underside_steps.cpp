#include "engine/simulate/underside_steps.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabwright {

std::optional<std::size_t> UndersideSteps::named_underside() {
    for (std::size_t u = 0; u < plan_.undersides.size(); ++u)
        if (plan_.undersides[u].layer == step().layer) return u;
    complain("sequence.layer", fmt::format("the plan mills no underside of layer {}", step().layer));
    return std::nullopt;
}

void UndersideSteps::mill_underside() {
    if (s_.board) complain("sequence.order", "the base board is mounted where the spoil board would lie");
    const std::optional<std::size_t> u = named_underside();
    if (!u) return;
    const UndersideToMill& under = plan_.undersides[*u];
    if (s_.undersides_milled[*u]) complain("sequence.order", "the underside is milled already");
    for (std::size_t other = 0; other < plan_.undersides.size(); ++other)
        if (s_.undersides_milled[other]) wait_for(s_.slabs_turned[other]);
    expect_word("sequence.program", "sequence", under.folder + "/sequence.json");
    if (under.minutes) expect_seconds(*under.minutes * 60, kSeconds);
    s_.undersides_milled[*u] = here();
}

void UndersideSteps::turn_over() {
    const std::optional<std::size_t> u = named_underside();
    if (!u) return;
    require(s_.undersides_milled[*u], "the underside is not milled");
    if (s_.slabs_turned[*u]) complain("sequence.order", "the slab is turned already");
    expect_job_seconds(plan_.job.bonding.handling_s / 3);
    s_.slabs_turned[*u] = here();
}

void UndersideSteps::hold_down() {
    if (!plan_.turned) complain("sequence.action", "is no action of this build");
    require(s_.to_press, "no slab lies on the board");
    if (s_.placed > 0) expect_layer(build_.slabs()[s_.placed - 1].layer);
    expect_job_seconds(plan_.job.bonding.handling_s / 3);
    s_.to_press.reset();
    s_.pressed = here();
}

void UndersideSteps::require_all_turned() {
    for (const UndersideToMill& under : plan_.undersides) require_turned(under.layer);
}

void UndersideSteps::require_turned(int layer) {
    for (std::size_t u = 0; u < plan_.undersides.size(); ++u) {
        if (plan_.undersides[u].layer != layer) continue;
        if (s_.slabs_turned[u]) wait_for(s_.slabs_turned[u]);
        else
            complain("sequence.order",
                     fmt::format("layer {}'s slab is not turned with its underside milled", layer));
    }
}

void UndersideSteps::check_undersides_at_end() {
    for (std::size_t u = 0; u < plan_.undersides.size(); ++u)
        if (!s_.slabs_turned[u])
            complain("sequence.missing",
                     fmt::format("the underside of layer {}'s slab is not milled, or the slab not turned",
                                 plan_.undersides[u].layer));
}

bool mills_underside(const BuildPlan& plan, int layer) {
    return std::any_of(plan.undersides.begin(), plan.undersides.end(),
                       [&](const UndersideToMill& under) { return under.layer == layer; });
}

}  // namespace slabwright
