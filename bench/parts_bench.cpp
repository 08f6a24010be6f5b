// Where the processor time of a whole plan goes, its proof and report included: one Markdown row a part and
// library of tools, the share of each phase in %, and their means, in which parts weigh alike.
//     build/release/parts_bench [--tools fixed,shop,luo] PART.stl…
// One thread, so that every second of the processor belongs to the phase that runs.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/slabwright.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

namespace fs = std::filesystem;

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// A column, and the phases of the engine that it sums up.
struct Column {
    const char* name;
    std::vector<std::string_view> phases;
};
const std::array<Column, 8> kColumns{{{"paths", {"paths"}},
                                      {"forces", {"forces"}},
                                      {"schedule", {"schedule"}},
                                      {"writing", {"writing"}},
                                      {"every move", {"checking moves"}},
                                      {"stock", {"cutting stock"}},
                                      {"report", {"report", "report's model and paths"}},
                                      {"reading and layers", {}}}};  // all that no other has

std::size_t column_of(std::string_view phase) {
    for (std::size_t i = 0; i + 1 < kColumns.size(); ++i)
        if (std::find(kColumns[i].phases.begin(), kColumns[i].phases.end(), phase) !=
            kColumns[i].phases.end())
            return i;
    return kColumns.size() - 1;
}

/// Processor seconds by column.
class Spent {
public:
    void now_in(std::string_view phase) {
        const double now = processor_seconds();
        by_column_[column_] += now - since_;
        since_ = now;
        column_ = column_of(phase);
    }
    [[nodiscard]] const std::array<double, kColumns.size()>& seconds() const { return by_column_; }
    [[nodiscard]] double all() const {
        double sum = 0;
        for (const double s : by_column_) sum += s;
        return sum;
    }

private:
    std::array<double, kColumns.size()> by_column_{};
    std::size_t column_ = kColumns.size() - 1;
    double since_ = processor_seconds();
};

Spent plan_and_prove(const std::string& part, const std::string& tools, const fs::path& folder) {
    Spent spent;
    Context context(
        {.threads = 1, .progress = [&](const Progress& progress) { spent.now_in(progress.phase); }});
    context.share_progress(0, kPlanningShare);
    Job job = read_job("", tools);
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    job.input.repair = Repair::mend;
    const std::shared_ptr<Pattern> pattern = read_pattern(context, part, job);
    Plan planned = plan(context, *pattern, job);
    const VerifyResult result = write_proven(context, planned, folder.string(), pattern, true);
    spent.now_in({});
    if (!result.passed)
        std::fprintf(stderr, "parts_bench: %s: the plan does not make the part\n", part.c_str());
    return spent;
}

void print_row(const std::string& part, const std::string& tools, double seconds,
               std::span<const double> shares) {
    std::printf("| %s | %s | %.1f |", part.c_str(), tools.c_str(), seconds);
    for (const double share : shares) std::printf(" %.0f |", 100 * share);
    std::printf("\n");
    std::fflush(stdout);
}

int run(std::span<char*> arguments) {
    std::vector<std::string> libraries{"fixed", "shop"}, parts;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        if (std::strcmp(arguments[i], "--tools") != 0) {
            parts.emplace_back(arguments[i]);
            continue;
        }
        libraries.clear();
        if (++i == arguments.size()) break;
        for (std::string_view rest = arguments[i]; !rest.empty();) {
            const std::size_t comma = std::min(rest.find(','), rest.size());
            libraries.emplace_back(rest.substr(0, comma));
            rest.remove_prefix(std::min(comma + 1, rest.size()));
        }
    }
    if (parts.empty() || libraries.empty()) {
        std::fprintf(stderr, "usage: parts_bench [--tools fixed,shop,luo] PART.stl…\n");
        return 2;
    }
    std::printf("| part | tools | CPU s |");
    for (const Column& column : kColumns) std::printf(" %s |", column.name);
    std::printf("\n|---|---|---|");
    for (std::size_t i = 0; i < kColumns.size(); ++i) std::printf("---|");
    std::printf("\n");
    const support::TemporaryFolder scratch;
    for (const std::string& tools : libraries) {
        double seconds = 0;
        std::array<double, kColumns.size()> mean{};
        for (const std::string& part : parts) {
            const Spent spent = plan_and_prove(part, tools, scratch / "out");
            std::array<double, kColumns.size()> shares = spent.seconds();
            for (std::size_t i = 0; i < shares.size(); ++i) {
                shares[i] /= spent.all();
                mean[i] += shares[i] / static_cast<double>(parts.size());
            }
            seconds += spent.all();
            print_row(fs::path(part).stem().string(), tools, spent.all(), shares);
        }
        print_row("all, weighed alike", tools, seconds, mean);
    }
    return 0;
}

}  // namespace
}  // namespace slabwright

int main(int argc, char** argv) {
    try {
        return slabwright::run(std::span(argv, static_cast<std::size_t>(argc)).subspan(1));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "parts_bench: %s\n", e.what());
        return 1;
    }
}
