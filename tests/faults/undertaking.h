// What commands make of OUT, and what io/FORMATS.md (Files and failures) promises of it when the system
// fails.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "tests/faults/faulty_run.h"
#include "tests/faults/plate_build.h"

namespace slabwright::faults {

/// Something that a command makes of OUT.
struct Undertaking {
    const char* name;
    /// Brings OUT to where the command begins.
    void (*prepare)(const PlateBuild&);
    Command (*command)(const PlateBuild&);
    long memory = 4;      ///< allocations that fail in a quick run
    long kills = 2;       ///< likewise, kills at chosen changes
    bool whole = true;    ///< all of OUT changes at once, else each file
    bool repeats = true;  ///< made once more it ends the same; else beside what there is
    bool maps = true;     ///< refused maps of memory are told; else they end in a library that is not ours
};

inline void expect_done(const Command& command) {
    const support::CommandResult result = support::run_command(command);
    ASSERT_EQ(result.exit, 0) << result.err;
}

inline void prepare_plan(const PlateBuild& build) { expect_done(build.plan()); }

inline void prepare_proof(const PlateBuild& build) {
    prepare_plan(build);
    expect_done(build.verify());
    support::spit(build.folder / "out/verify.json", "{}\n");
    if (std::filesystem::exists(build.folder / "out/report.html"))
        support::spit(build.folder / "out/report.html", "<html>slabwright</html>\n");
}

inline const Undertaking kUndertakings[] = {
    {.name = "plan",
     .prepare = [](const PlateBuild&) {},
     .command = [](const PlateBuild& b) { return b.plan(); },
     .memory = 12,
     .kills = 5},
    {.name = "plan_anew",
     .prepare =
         [](const PlateBuild& b) {
             const PlateBuild old(21);
             prepare_plan(old);
             b.restore(old.tree());
         },
     .command = [](const PlateBuild& b) { return b.plan(); }},
    {.name = "verify",
     .prepare = prepare_proof,
     .command = [](const PlateBuild& b) { return b.verify(); },
     .memory = 10,
     .whole = false},
    {.name = "report",
     .prepare = prepare_proof,
     .command = [](const PlateBuild& b) { return b.report(); },
     .maps = false},
    {.name = "resume",
     .prepare = prepare_plan,
     .command =
         [](const PlateBuild& b) {
             return b.resume({"--after", "24"});
         }},
    {.name = "resume_remake",
     .prepare =
         [](const PlateBuild& b) {
             prepare_plan(b);
             expect_done(b.resume({"--after", "24"}));
         },
     .command =
         [](const PlateBuild& b) {
             return b.resume({"--remake", "2"});
         },
     .repeats = false},
    {.name = "resume_both",
     .prepare = prepare_plan,
     .command =
         [](const PlateBuild& b) {
             return b.resume({"--after", "24", "--remake", "2"});
         },
     .repeats = false},
};

inline std::ostream& operator<<(std::ostream& out, const Undertaking& u) { return out << u.name; }

/// Without what a killed process was writing.
inline Tree without_partial(const Tree& tree) {
    Tree rest;
    for (const auto& [name, text] : tree)
        if (name.find(".partial-") == std::string::npos) rest.emplace(name, text);
    return rest;
}

/// Whether each file is the one of before or the one of after, whole; or there is none, where one of them has
/// none.
inline bool each_of_either(const Tree& now, const Tree& before, const Tree& after) {
    Tree rest = now;
    for (const Tree* tree : {&before, &after})
        for (const auto& [name, text] : *tree) {
            const bool in_both = before.contains(name) && after.contains(name);
            if (in_both && !now.contains(name)) return false;
            const auto at = rest.find(name);
            if (at != rest.end() && same({*at}, {{name, text}})) rest.erase(at);
        }
    return rest.empty();
}

/// An undertaking that is tried again and again, each time from its beginning.
class Attempts {
public:
    explicit Attempts(const Undertaking& undertaking) : u_(undertaking) {
        u_.prepare(build_);
        before_ = build_.tree();
        command_ = u_.command(build_);
        expect_done(command_);
        after_ = build_.tree();
        begin();
    }

    void begin() const { build_.restore(before_); }
    [[nodiscard]] const Command& command() const { return command_; }
    [[nodiscard]] const std::string& folder() const { return folder_; }

    /// 3 and 4: a killed process leaves the old or the new, and nothing that hinders whoever comes next.
    void expect_survived(const std::string& what) const {
        const Tree now = without_partial(build_.tree());
        if (u_.whole && u_.repeats) {
            EXPECT_TRUE(same(now, before_) || same(now, after_)) << what << ": OUT is neither old nor new";
        } else {
            EXPECT_TRUE(each_of_either(now, before_, after_)) << what << ": a file is neither old nor new";
        }
        const support::CommandResult again = support::run_command(command_);
        EXPECT_EQ(again.exit, 0) << what << ", then " << again.err;
        if (u_.repeats) {
            EXPECT_TRUE(same(without_partial(build_.tree()), after_)) << what << ": another end";
        }
        std::filesystem::remove(build_.folder / "out/progress.json");  // or there is no other plan
        if (!u_.repeats) return;
        const support::CommandResult plan = support::run_command(build_.plan());
        EXPECT_EQ(plan.exit, 0) << what << ", then " << plan.err;
        EXPECT_EQ(build_.strangers(), "") << what;
        for (const auto& [name, text] : build_.tree())
            EXPECT_EQ(name.find(".partial-"), std::string::npos) << what << ": " << name;
    }

    /// 1 and 2: it is done, or told and not done. @returns whether it was told
    bool expect_done_or_told(const support::CommandResult& result, const std::string& what) const {
        const Tree now = build_.tree();
        EXPECT_EQ(build_.strangers(), "") << what;
        if (result.exit == 0) {
            // A report that cannot be made again is told, and changes no verdict.
            const bool without_report =
                !u_.whole &&
                result.out.find("report.html could not be brought up to date") != std::string::npos;
            EXPECT_TRUE(same(now, without_report ? with_old_report() : after_))
                << what << ": another result, exit 0";
            return without_report;
        }
        expect_clear_error(result, what);
        EXPECT_TRUE(u_.whole ? same(now, before_) : each_of_either(now, before_, after_))
            << what << ": OUT is changed, " << result.err;
        return true;
    }

private:
    [[nodiscard]] Tree with_old_report() const {
        Tree tree = after_;
        tree["report.html"] = before_.at("report.html");
        return tree;
    }

    const Undertaking& u_;
    PlateBuild build_;
    std::string folder_ = build_.folder.path.string();
    Tree before_, after_;
    Command command_;
};

}  // namespace slabwright::faults
