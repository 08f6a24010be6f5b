// Chains of sharp edges, as JSON and for people.
#pragma once

#include <span>
#include <string>

#include "io/text/json_text.h"
#include "kernels/features/edge_chains.h"

namespace slabwright {

/// An object: the limit, how many convex and concave chains there are and how long they are, and the longest
/// fifty.
void put_edges(JsonText& json, std::span<const EdgeChain> chains, double least_deg);

/// A line of `inspect`; empty where there is none.
[[nodiscard]] std::string edges_text(std::span<const EdgeChain> chains, double least_deg);

}  // namespace slabwright
