// A post of the user's own, read from TOML (io/FORMATS.md, A post of your own). Its keys are those of
// io/text/post_keys.h. What comes out of here is safe to write with: its lines hold nothing that the proof
// does not read, and programs written with it have been read back.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "io/posts/dialect.h"

namespace slabwright {

/// Reads a post from TOML text, checks its lines, writes programs with it and reads them back (probe_post).
/// @param file names the text in errors
/// @throws Error(usage) with file:line and remedy: post.syntax (not TOML), post.unknown_key,
/// post.missing_key,
///   post.type, post.range, post.word, post.base for a base that is none or conversational, post.template for
///   a line with characters, placeholders, comments or words that may not stand there, post.state for one
///   that would move, or change what the proof relies on, post.probe for a program that reads back otherwise
[[nodiscard]] std::shared_ptr<const OwnDialect> parse_own_post(std::string_view text,
                                                               const std::string& file);

/// The same of a file. @throws also Error(usage): post.missing, post.directory, post.unreadable,
/// post.too_large
[[nodiscard]] std::shared_ptr<const OwnDialect> read_own_post(const std::filesystem::path& path);

/// A post file that writes just as a control's own dialect does, every key with a comment: what a post of
/// one's own begins with. @throws Error(usage, "post.base") for a conversational control
[[nodiscard]] std::string post_toml(Post base);

}  // namespace slabwright
