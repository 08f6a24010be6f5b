// The lines of a post of the user's own, one by one: what may stand in them, before any program is written.
#pragma once

#include <string>
#include <string_view>

#include "io/posts/dialect.h"
#include "io/text/post_keys.h"

namespace slabwright {

/// Checks one line of a template or of the extra lines.
/// @param dialect with all keys of the post
/// @param place of the line, "my.toml:12"
/// @throws Error(usage): post.template for characters beyond printing ASCII, a line too long, a % among other
///   characters, a brace or placeholder that is none of this part's, or a comment or word that the control's
///   reader refuses; post.state, by name, for a word that moves, or changes what the proof relies on: G0 to
///   G3 and coordinates outside of `first`, G20 and G21 (their place is {unit}), G91, other offsets than G54,
///   stops, and in extra lines everything but switches and comments
void check_post_line(std::string_view line, PostPart part, const Dialect& dialect, const std::string& place);

}  // namespace slabwright
