// The `slabwright` command: plan, verify, resume, report, inspect, repair, prepare, orient, quote,
// split, slice, sheets, feed, bond, job. Errors are one line on stderr, their kind is the exit code.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/paths/operations/dowel_holes.h"
#include "io/front_door.h"
#include "io/orient.h"
#include "io/prepare.h"
#include "io/quote.h"
#include "io/slabwright.h"
#include "io/ways_out.h"
#include "tools/allocator.h"
#include "tools/bond_command.h"
#include "tools/inspect_command.h"
#include "tools/job_command.h"
#include "tools/plan_text.h"
#include "tools/prepare_command.h"
#include "tools/print_pdf.h"
#include "tools/progress_bar.h"
#include "tools/resume_command.h"
#include "tools/sheets_command.h"
#include "tools/sides_option.h"
#include "tools/split_command.h"
#include "tools/streams.h"

namespace {

using namespace slabwright;

/// The one plan that a signal can cancel. Only lock-free atomics may be touched in a handler.
std::atomic<Context*> running{nullptr};

extern "C" void on_signal(int signal) {
    if (Context* context = running.load()) context->cancel();
    std::signal(signal, SIG_DFL);  // a second Ctrl-C ends the process at once
}

struct Options {
    PrepareOptions prepare;
    InspectionOptions inspection;
    std::string pdf;  ///< of the setup sheets; "": none
    std::string orient, repair, stl, out, maps, access_maps, job_file, tools, units, strategy, sides, finder,
        device, post;
    int threads = 0, plans = 3;
    double memory_gib = 0, weld = 0, every = 0, size_limit_mb = 10, cell = 0;
    bool allow_undercut = false, accept_weak = false, no_verify = false, keep_failed = false, json = false,
         quiet = false, weld_given = false, no_3d = false, rebuild = false;
};

Job job_of(const Options& options) {
    const Job job = read_job(options.job_file, options.tools, options.post);
    // An option is a key of the job, and says so in TOML. The words are checked already.
    std::string keys;
    const auto put = [&](std::string_view key, const std::string& value) {
        if (!value.empty()) keys += fmt::format("{} = {}\n", key, value);
    };
    const auto word = [&](std::string_view key, const std::string& value) {
        if (!value.empty()) put(key, '"' + value + '"');
    };
    word("units", options.units);
    put("allow_undercut", options.allow_undercut ? "true" : "");
    word("input.repair", options.repair);
    put("bonding.accept_weak", options.accept_weak ? "true" : "");
    word("layers.strategy", options.strategy);
    word("layers.sides", options.sides);
    const bool two_sided = !options.sides.empty() && options.sides != "one";
    if (two_sided && job.dowels.per_joint == 0) {
        put("dowels.per_joint", "2");
        // Nobody has chosen them: such as the library makes holes for.
        if (job.dowels.diameter == JointDowels{}.diameter)
            if (const auto size = dowel_size(job, job.dowels.depth))
                put("dowels.diameter", fmt::format("{:.1f}", *size));
    }
    word("layers.finder", options.finder);
    put("tolerances.weld", options.weld_given ? fmt::format("{}", options.weld) : "");
    keys += prepare_keys(options.prepare);
    return keys.empty() ? job : job_from_toml(keys, "command line", job);
}

/// Bytes of memory that the process keeps for the next array, of sheets: theirs differ from one to the next.
constexpr std::uint64_t kKeptForSheets = std::uint64_t{3} << 29;

/// Runs a body with a context that Ctrl-C cancels and whose progress a terminal sees. @param kept bytes at
/// most
template <class Body>
void with_context(const Options& options, [[maybe_unused]] std::uint64_t kept, Body&& body) {
    ProgressBar bar;
    Context::Options settings;
    settings.threads = options.threads;
    settings.device = options.device;
    settings.memory_bytes = static_cast<std::uint64_t>(options.memory_gib * (1u << 30));
    if (!options.quiet && !options.json && isatty(STDERR_FILENO) != 0)
        settings.progress = [&](const Progress& progress) { bar.show(progress); };
    Context context(std::move(settings));
#ifdef SLABWRIGHT_JEMALLOC
    const KeptWithin keeper(std::min<std::uint64_t>(context.memory_limit() / 2, kept));
#endif
    running = &context;
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    // Whoever runs it under nohup wants it to go on when the terminal is closed.
    if (std::signal(SIGHUP, on_signal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the user's limit is then an error of the write
    struct Done {
        ProgressBar& bar;
        ~Done() {
            running = nullptr;
            bar.clear();
        }
    };
    std::string output;
    {
        const Done done{bar};
        output = guarded([&] { return body(context); });
    }
    if (!options.quiet) print(output);
}

template <class Body>
void with_context(const Options& options, Body&& body) {
    with_context(options, UINT64_MAX, std::forward<Body>(body));
}

void run_orient(const Options& options) {
    const Job job = job_of(options);
    with_context(options, [&](Context& context) {
        const OrientModel model =
            orient_model(context, options.stl, job, static_cast<std::size_t>(options.plans));
        return options.json ? orient_json(model) : orient_text(model);
    });
}

void run_quote(const Options& options) {
    const Job job = job_of(options);
    with_context(options, [&](Context& context) {
        const QuotedModel model = quote_model(context, options.stl, job);
        return options.json ? quote_json(model) : quote_text(model);
    });
}

/// What is said of files that are written by now: where memory ends, they are no less written.
template <class Text>
std::string said(const Options& options, Text&& text) {
    if (options.quiet) return {};
    try {
        return text();
    } catch (const std::bad_alloc&) {
        return {};
    }
}

/// Returns the exit code: whether the programs make the part, as far as that was asked.
int run_plan(const Options& options) {
    if (options.orient == "report") {
        run_orient(options);
        return 0;
    }
    Job job = job_of(options);
    require_replaceable(options.out);  // before an hour of planning, not after it
    VerifyResult found;
    found.passed = true;
    std::optional<Error> refused;  // for undercuts: what would help is told beside it
    with_context(options, [&](Context& context) {
        std::string lies;
        if (options.orient == "auto") {
            job = oriented(job, orient_model(context, options.stl, job));
            const std::vector<double>& turn = job.prepare.turn;
            lies =
                fmt::format("{}: turned by {:g} {:g} {:g} degrees\n", options.stl, turn[0], turn[1], turn[2]);
        }
        if (!options.no_verify) context.share_progress(0, kPlanningShare);
        std::shared_ptr<Pattern> pattern = read_pattern(context, options.stl, job);
        Plan result;
        try {
            result = plan(context, *pattern, job);
        } catch (const Error& error) {
            if (error.code() != "undercut.unmade" || options.quiet) throw;
            refused = error;
            const WaysOut ways = find_ways_out(context, *pattern, job, options.out);
            return options.json ? ways_out_json(ways) : ways_out_text(ways);
        }
        if (!options.access_maps.empty())
            write_access_maps(context, result, options.stl, options.access_maps);
        if (options.no_verify) {
            pattern.reset();
            write(context, result, options.out, options.stl);
            return said(options, [&] {
                return options.json ? plan_summary_json(result, options.out, nullptr)
                                    : lies + summary(result, options.out);
            });
        }
        found = write_proven(context, result, options.out, pattern, options.keep_failed, options.cell);
        if (!found.written) return std::string();
        return said(options, [&] {
            return options.json ? plan_summary_json(result, options.out, &found)
                                : lies + summary(result, options.out) + verdict(found, options.out);
        });
    });
    if (refused) return complain(*refused, options.json);
    const std::span<const Error> refusals(found.refusals);
    if (options.json && !refusals.empty()) return complain(refusals[0], true, refusals.subspan(1));
    constexpr std::size_t shown = 20;  // one line each
    for (const Error& e : refusals.first(std::min(shown, refusals.size()))) complain(e, false);
    if (refusals.size() > shown) std::fprintf(stderr, "slabwright: %zu more\n", refusals.size() - shown);
    if (!found.written) return static_cast<int>(ErrorKind::no_plan);
    return found.passed ? 0 : static_cast<int>(ErrorKind::verification);
}

/// Returns whether the programs make the part.
bool run_sheets(const Options& options, const SheetsOptions& asked) {
    const Job reading = job_of(options);
    const SheetJob job = sheet_job(asked);
    bool passed = false;
    with_context(options, kKeptForSheets, [&](Context& context) {
        const SheetsResult result = make_sheets(context, options.stl, reading, job, options.out,
                                                {.left_over = asked.tolerance}, sheet_extras(asked));
        passed = result.proof.passed;
        return sheets_summary(result, options.out, options.json);
    });
    return passed;
}

bool run_verify(const Options& options) {
    bool passed = false;
    if (holds_sheets(options.out)) {
        with_context(options, kKeptForSheets, [&](Context& context) {
            const SheetProof proof = verify_sheets(context, options.out, options.stl, {});
            passed = proof.passed;
            return sheets_verdict(proof, options.out);
        });
        return passed;
    }
    with_context(options, [&](Context& context) {
        const std::vector<KeepOut> keep_outs = job_of(options).machine.keep_outs;
        const RenewedVerdict found = reverify(context, options.out, options.stl, options.maps, options.cell,
                                              options.job_file.empty() ? nullptr : &keep_outs);
        passed = found.result.passed;
        return said(options, [&] { return verdict(found.result, options.out) + found.stale; });
    });
    return passed;
}

void run_report(const Options& options) {
    with_context(options, [&](Context& context) {
        report(context, options.out, options.stl, !options.no_3d, options.size_limit_mb);
        if (!options.pdf.empty()) print_pdf(options.out + "/report.html", options.pdf);
        return said(options, [&] {
            return options.json ? report_summary_json(options.out) : options.out + "/report.html\n";
        });
    });
}

void run_inspect(const Options& options) {
    const Job job = job_of(options);
    with_context(options, [&](Context& context) {
        return inspect(context, options.stl, job, options.json ? InspectionForm::json : InspectionForm::text,
                       options.inspection);
    });
}

void run_repair(const Options& options) {
    Job job = job_of(options);
    job.input.repair = options.rebuild ? Repair::rebuild : Repair::mend;
    with_context(options, [&](Context& context) {
        const RepairResult result = repair(context, options.stl, options.out, job);
        if (options.json) return repair_summary_json(result, options.out);
        return repair_text(result, options.out);
    });
}

void run_prepare(const Options& options) {
    Job job = job_of(options);
    with_context(options, [&](Context& context) {
        if (options.orient == "auto") job = oriented(job, orient_model(context, options.stl, job));
        const PreparedModel model = prepare_model(context, options.stl, job, options.out);
        return options.json ? prepare_json(model, options.out) : prepare_text(model, options.out);
    });
}

void run_split(const Options& options, const SplitOptions& asked) {
    const Job job = job_of(options);
    with_context(options, [&](Context& context) {
        const SplitModel model = split_model(context, options.stl, job, split_request(asked));
        return options.json ? split_json(model) : split_text(model);
    });
}

void run_slice(const Options& options) {
    const Job job = job_of(options);
    with_context(options, [&](Context& context) {
        slice_to_file(context, options.stl, job, options.every, options.out);
        return std::string();
    });
}

void add_limits(CLI::App& command, Options& options) {
    command.add_option("--threads", options.threads, "threads to use; all that the machine has if not given")
        ->check(CLI::Range(1, 1024));
    command
        .add_option("--memory", options.memory_gib,
                    "GiB of memory that may be used; 60 % of the machine's if not given")
        ->check(CLI::Range(0.001, 1e6));
    command.add_option("--device", options.device,
                       "OpenCL device for cutting forces: auto (the fastest that passes a test), reference "
                       "(none), or a part of its name");
    command.add_flag("--json", options.json, "errors as JSON on stderr, results as JSON on stdout");
    command.add_flag("--quiet", options.quiet, "no progress bar, nothing on stdout");
}

void add_reading(CLI::App& command, Options& options) {
    command.add_option("--units", options.units, "of the STL: mm or in")->check(CLI::IsMember({"mm", "in"}));
    command
        .add_option_function<double>(
            "--weld",
            [&options](const double& weld) {
                options.weld = weld;
                options.weld_given = true;
            },
            "mm: vertices this near are merged, and reported")
        ->check(CLI::Range(0.0, 100.0));
}

void add_common(CLI::App& command, Options& options) {
    add_limits(command, options);
    command.add_option("--job", options.job_file, "job file; `slabwright job --defaults` prints one");
    command.add_option(
        "--tools", options.tools,
        "tool library: fixed, shop, forms, metric, luo, or a file .tbl, .fctl, .fctb or .csv (io/JOB.md)");
    command.add_option(
        "--post", options.post,
        "instead of machine.post: linuxcnc, fanuc, haas, grbl, mach, iso, siemens, heidenhain, or "
        "a post of your own, a file (io/FORMATS.md)");
    add_reading(command, options);
    command
        .add_flag("--repair{mend}", options.repair,
                  "mend a mesh that is no solid; --repair=rebuild makes its surface anew where mending does "
                  "not close it")
        ->check(CLI::IsMember({"none", "mend", "rebuild"}));
    add_prepare_options(command, options.prepare);
}

CLI::App* add_inspect_command(CLI::App& app, Options& options) {
    CLI::App* command = app.add_subcommand(
        "inspect", "report on mesh, features, undercuts, and what keeps the pattern from being drawn");
    command->add_option("STL", options.stl, "the pattern")->required();
    add_common(*command, options);
    command->add_option("--finder", options.finder, "of features: exact, halving or both")
        ->check(CLI::IsMember({"exact", "halving", "both"}));
    add_inspection_options(*command, options.inspection);
    return command;
}

CLI::App* add_plan_command(CLI::App& app, Options& options) {
    CLI::App* command = app.add_subcommand("plan", "plan the build of a pattern and write it to a folder");
    command->add_option("STL", options.stl, "the pattern")->required();
    command->add_option("-o,--out", options.out, "folder for the plan; a plan in it is replaced")->required();
    add_common(*command, options);
    command->add_option("--strategy", options.strategy, "of layer placement: optimal, printed or combined")
        ->check(CLI::IsMember({"optimal", "printed", "combined"}));
    add_sides_option(*command, options.sides);
    command->add_option("--finder", options.finder, "of features: exact, halving or both")
        ->check(CLI::IsMember({"exact", "halving", "both"}));
    command
        ->add_option("--orient", options.orient,
                     "auto: laid on the side on which it is best built; report: only what each side would "
                     "give, as `orient` tells it")
        ->check(CLI::IsMember({"auto", "report"}));
    command->add_flag("--allow-undercut", options.allow_undercut, "plan although undercuts stay unmade");
    command->add_flag("--accept-weak-joints", options.accept_weak, "plan although a joint may not hold");
    command->add_option("--access-maps", options.access_maps,
                        "folder for what each tool reaches of each layer's facets, as PLY");
    command->add_flag("--keep-failed", options.keep_failed,
                      "write the programs also where they do not make the part (exit code 5)");
    command->add_flag("--no-verify", options.no_verify, "write the plan without simulating its programs");
    return command;
}

CLI::App* add_prepare_command(CLI::App& app, Options& options) {
    CLI::App* command =
        app.add_subcommand("prepare", "turn, scale, shrink, mirror or shift a model, or give it a skin");
    command->add_option("MODEL", options.stl, "the model")->required();
    command->add_option("-o,--out", options.out, "the model in millimetres: .stl or .3mf")->required();
    command->add_option("--orient", options.orient, "auto: laid on the side on which it is best built")
        ->check(CLI::IsMember({"auto"}));
    add_common(*command, options);
    return command;
}

CLI::App* add_orient_command(CLI::App& app, Options& options) {
    CLI::App* command =
        app.add_subcommand("orient",
                           "on which side a model is best built: what each leaves unmade, its layers, "
                           "foot and time");
    command->add_option("MODEL", options.stl, "the model")->required();
    command->add_option("--plans", options.plans, "how many of the best are planned, for their time")
        ->check(CLI::Range(0, 20));
    add_common(*command, options);
    return command;
}

CLI::App* add_quote_command(CLI::App& app, Options& options) {
    CLI::App* command = app.add_subcommand(
        "quote",
        "what a build takes, without a plan: layers, slabs, glue, about how long, what stays unmade");
    command->add_option("MODEL", options.stl, "the pattern")->required();
    add_sides_option(*command, options.sides);
    add_common(*command, options);
    return command;
}

CLI::App* add_repair_command(CLI::App& app, Options& options) {
    CLI::App* command = app.add_subcommand(
        "repair", "mend a mesh that is no solid: what was wrong is told, and a solid is written");
    command->add_option("STL", options.stl, "the mesh")->required();
    command->add_option("-o,--out", options.out, "STL for the solid, in the mesh's unit and place")
        ->required();
    command->add_flag("--rebuild", options.rebuild, "make the surface anew where mending does not close it");
    add_reading(*command, options);
    add_limits(*command, options);
    return command;
}

CLI::App* add_report_command(CLI::App& app, Options& options) {
    CLI::App* command = app.add_subcommand(
        "report", "make OUT/report.html again: the build to be seen before the wood is cut");
    command->add_option("OUT", options.out, "folder of the plan")->required();
    command->add_option("--stl", options.stl, "the pattern; the file that plan.json names, if not given");
    command->add_flag("--no-3d", options.no_3d, "a light page: no model, no paths");
    command->add_option("--pdf", options.pdf,
                        "the setup sheets as PDF too, printed by an installed Chromium");
    command
        ->add_option("--size-limit", options.size_limit_mb,
                     "MB that the page may have; detail is left out to keep to it")
        ->check(CLI::Range(0.1, 1000.0));
    add_limits(*command, options);
    return command;
}

CLI::App* add_sheets_command(CLI::App& app, Options& options, SheetsOptions& asked) {
    CLI::App* command = app.add_subcommand("sheets", "plan a part as sheets cut from stock and bonded");
    command->add_option("STL", options.stl, "the part")->required();
    command->add_option("-o,--out", options.out, "folder for the sheets; a plan in it is replaced")
        ->required();
    add_common(*command, options);
    add_sheets_options(*command, asked);
    return command;
}

/// Reads the command line and does what it asks for. @return the exit code
int command(int argc, char** argv) {
#if defined(__x86_64__) && defined(__AVX2__)
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("bmi2")) {
        std::fputs(
            "slabwright: this machine lacks AVX2, for which this program was built; build it here, or with "
            "-DSLABWRIGHT_X86_LEVEL=baseline\n",
            stderr);
        return static_cast<int>(ErrorKind::usage);
    }
#endif
    Options options;
    CLI::App app(
        "Plans Rapid Pattern Manufacturing: from the model of a foundry pattern to layers, tool paths, "
        "G-code "
        "and the build sequence.",
        "slabwright");
    app.set_version_flag("--version", "slabwright " + version() + "\nreads " + pattern_formats());
    app.require_subcommand(1);

    CLI::App* plan_command = add_plan_command(app, options);
    CLI::App* verify_command = app.add_subcommand("verify", "simulate a plan's programs on the pattern");
    verify_command->add_option("OUT", options.out, "folder of the plan")->required();
    verify_command->add_option("--stl", options.stl,
                               "the pattern; the file that plan.json names, if not given");
    for (CLI::App* command : {plan_command, verify_command})
        command
            ->add_option("--cell", options.cell,
                         "mm between points of the simulated stock; default: as the cusp asks")
            ->check(CLI::Range(0.01, 10.0));
    verify_command->add_option("--maps", options.maps,
                               "folder for a picture of each layer: left over, missed, unreachable, gouged");
    verify_command->add_option("--keep-outs", options.job_file, "job file of what stands on the table");
    add_limits(*verify_command, options);

    ResumeOptions resume_options;
    CLI::App* resume_command = add_resume_command(app, options.out, resume_options);
    add_limits(*resume_command, options);
    CLI::App* report_command = add_report_command(app, options);

    CLI::App* inspect_command = add_inspect_command(app, options);
    CLI::App* repair_command = add_repair_command(app, options);
    CLI::App* slice_command = app.add_subcommand("slice", "cut the pattern by level planes");
    slice_command->add_option("STL", options.stl, "the pattern")->required();
    slice_command->add_option("--every", options.every, "mm from one section to the next")->required();
    slice_command->add_option("-o,--out", options.out, "drawing: .svg, .dxf or .json")->required();
    add_common(*slice_command, options);

    CLI::App* prepare_command = add_prepare_command(app, options);
    CLI::App* orient_command = add_orient_command(app, options);
    CLI::App* quote_command = add_quote_command(app, options);
    SplitOptions split_options;
    CLI::App* split_command = app.add_subcommand("split", "cut a model into two halves, capped and dowelled");
    split_command->add_option("MODEL", options.stl, "the model")->required();
    add_common(*split_command, options);
    add_split_options(*split_command, split_options);
    SheetsOptions sheets_options;
    CLI::App* sheets_command = add_sheets_command(app, options, sheets_options);
    FeedOptions feed_options;
    CLI::App* feed_command = add_feed_command(app, feed_options);

    BondOptions bond_options;
    CLI::App* bond_command = add_bond_command(app, bond_options);

    JobOptions job_options;
    add_job_command(app, job_options);

    // An error of the command line comes before its options are known, so --json is looked for by hand.
    const bool json_wanted = std::any_of(
        argv + 1, argv + argc, [](const char* argument) { return std::string_view(argument) == "--json"; });
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // --help, --version
            app.exit(error);
            std::cout.flush();
            if (std::cout.good() && std::fflush(stdout) == 0) return 0;
            return complain(Error(ErrorKind::input, "stdout.unwritable", "standard output cannot be written",
                                  "", "make room where it goes, or send it elsewhere"),
                            json_wanted);
        }
        return complain(Error(ErrorKind::usage, "usage", error.what(), "", "see slabwright --help"),
                        json_wanted);
    }
    try {
        if (*plan_command) return run_plan(options);
        else if (*verify_command) return run_verify(options) ? 0 : static_cast<int>(ErrorKind::verification);
        else if (*resume_command)
            with_context(options, [&](Context& context) {
                return run_resume(context, options.out, resume_options, options.json);
            });
        else if (*report_command) run_report(options);
        else if (*inspect_command) run_inspect(options);
        else if (*repair_command) run_repair(options);
        else if (*prepare_command) run_prepare(options);
        else if (*orient_command) run_orient(options);
        else if (*quote_command) run_quote(options);
        else if (*split_command) run_split(options, split_options);
        else if (*slice_command) run_slice(options);
        else if (*sheets_command)
            return run_sheets(options, sheets_options) ? 0 : static_cast<int>(ErrorKind::verification);
        else if (*feed_command) print(run_feed(feed_options));
        else if (*bond_command) print(run_bond(bond_options));
        else print(run_job(job_options));
        return 0;
    } catch (const Error& error) {
        return complain(error, options.json || bond_options.json || feed_options.json || job_options.json);
    } catch (const std::exception& error) {
        return complain(
            Error(ErrorKind::no_plan, "internal", error.what(), "", "report this with the command line"),
            options.json || bond_options.json);
    }
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return command(argc, argv);
    } catch (const std::bad_alloc&) {  // even before the command line was read
        std::fputs("slabwright: there is not enough memory to begin; free some, or raise the limit\n",
                   stderr);
        return static_cast<int>(ErrorKind::no_plan);
    }
}
