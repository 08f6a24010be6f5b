// Tests of joints as a table: a line each, factors and strength in columns.
#pragma once

#include <string>
#include <vector>

#include "engine/bonding/bond_study.h"

namespace slabwright {

struct BondCsvOptions {
    std::string response = {};              ///< the column that was measured; "": the last
    std::vector<std::string> ignored = {};  ///< columns that are no factors, run orders for one
};

inline constexpr std::size_t kMostBondRows = 10000;

/// Reads comma-separated text (RFC 4180, a header line first; lines that begin with # and empty ones are
/// passed over). Each column beside the response is a factor. Its levels are in the order of its values where
/// all are numbers; low, medium and high (thin and thick, small and large, no and yes) in that order; other
/// words as they come. Numbers are coded evenly from −1 to 1; two words are −1 and 1; more words than low,
/// medium and high have no code.
/// @throws Error(input, "bond.…") with file, line and remedy, Error(usage, "bond.column") for a column that
/// is not there
[[nodiscard]] BondTests read_bond_csv(const std::string& path, const BondCsvOptions& options = {});

}  // namespace slabwright
