// Programs that are made to lose something: whether a post of the user's own says all that a plan means.
#pragma once

#include <memory>
#include <string>

#include "io/posts/dialect.h"

namespace slabwright {

/// Writes programs with a post, in millimetres and in inches, reads them back by its own reader, and holds
/// them against the moves that were meant: negative and tiny coordinates, whole numbers, all axes at once,
/// arcs either way, several feeds, tools, spindle speeds and dwells, in programs of one operation and of
/// several.
/// @param file the post's, for errors
/// @throws Error(usage, "post.probe") with the program's line and what it lost: what the reader refuses, a
/// place
///   more than 1.3 µm away, a motion, an arc, a feed, a tool, a speed, a dwell, a program number
void probe_post(const std::shared_ptr<const OwnDialect>& post, const std::string& file);

}  // namespace slabwright
