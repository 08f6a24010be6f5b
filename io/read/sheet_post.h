// Codes of the machines that cut sheets, read from TOML (io/FORMATS.md, A post for sheets).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/sheets/sheet_plan.h"

namespace slabwright {

/// What a post says of one head; what it does not say is as the job has it.
struct SheetCodes {
    std::optional<std::string> on, off;                  ///< of a laser or a jet
    std::optional<double> pierce_s;                      ///< seconds, of a laser or a jet
    std::optional<double> clearance;                     ///< mm over the stock
    std::optional<std::vector<std::string>> begin, end;  ///< SheetJob::begin, SheetJob::end
};

struct SheetPost {
    SheetCodes router, laser, jet;
    [[nodiscard]] const SheetCodes& of(SheetHead head) const;
};

/// @param file names the text in errors. @throws Error(usage) with file:line and remedy: post.syntax (not
/// TOML), post.unknown_key, post.type, post.range. What words may stand there plan_sheets() says.
[[nodiscard]] SheetPost parse_sheet_post(std::string_view text, const std::string& file);

/// The same of a file. @throws also Error(usage): post.missing, post.directory, post.unreadable,
/// post.too_large
[[nodiscard]] SheetPost read_sheet_post(const std::filesystem::path& path);

/// A job with what the post says of its head.
void apply(const SheetPost& post, SheetJob& job);

}  // namespace slabwright
