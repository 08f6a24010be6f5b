#include "tools/print_pdf.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "kernels/errors.h"

extern char** environ;

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::minutes kPatience{2};
constexpr std::chrono::milliseconds kGlance{50};

/// An executable of this name in $PATH.
std::optional<std::string> in_path(const std::string& name) {
    const char* path = ::getenv("PATH");
    for (std::string_view rest = path != nullptr ? path : ""; !rest.empty();) {
        const std::size_t end = std::min(rest.find(':'), rest.size());
        const std::string file = std::string(rest.substr(0, end)) + "/" + name;
        if (::access(file.c_str(), X_OK) == 0) return file;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return std::nullopt;
}

std::string browser() {
    if (const char* named = ::getenv("SLABWRIGHT_CHROMIUM"); named != nullptr && *named != '\0') return named;
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
        if (const std::optional<std::string> file = in_path(name)) return *file;
    throw Error(ErrorKind::usage, "pdf.browser", "no browser that prints is installed", "--pdf",
                "apt install chromium, or open report.html and print it");
}

/// "file:///a%20b"
std::string url_of(const fs::path& file) {
    std::string url = "file://";
    for (const char c : fs::absolute(file).string()) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view("/-._~").find(c) != std::string_view::npos;
        constexpr std::string_view digits = "0123456789ABCDEF";
        const auto byte = static_cast<unsigned char>(c);
        if (plain) url += c;
        else url += {'%', digits[byte >> 4], digits[byte & 15]};
    }
    return url;
}

/// A folder for the browser's own files.
class Workplace {
public:
    Workplace() {
        std::string name = (fs::temp_directory_path() / "slabwright-pdf-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr)
            throw Error(ErrorKind::input, "pdf.write", "no folder can be made", name, "make room in it");
        path = name;
    }
    ~Workplace() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    Workplace(const Workplace&) = delete;
    Workplace& operator=(const Workplace&) = delete;
    fs::path path;
};

/// Runs a program with its output away. @return whether it ended well in time
bool ran(std::vector<std::string> arguments) {
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        ::posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
    pid_t child = 0;
    const int failed = ::posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) return false;
    const auto until = std::chrono::steady_clock::now() + kPatience;
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (std::chrono::steady_clock::now() > until) {
            ::kill(child, SIGKILL);
            ::waitpid(child, &status, 0);
            return false;
        }
        std::this_thread::sleep_for(kGlance);
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool is_pdf(const fs::path& file) {
    std::array<char, 5> head{};
    std::ifstream in(file, std::ios::binary);
    return in.read(head.data(), head.size()) && std::string_view(head.data(), head.size()) == "%PDF-";
}

}  // namespace

void print_pdf(const std::string& page, const std::string& pdf) {
    const std::string program = browser();
    const Workplace work;
    const fs::path printed = work.path / "printed.pdf", place(pdf);
    std::vector<std::string> line{program,
                                  "--headless",
                                  "--disable-gpu",
                                  "--no-pdf-header-footer",
                                  "--user-data-dir=" + (work.path / "profile").string(),
                                  "--host-resolver-rules=MAP * ~NOTFOUND",
                                  "--print-to-pdf=" + printed.string()};
    if (::geteuid() == 0) line.emplace_back("--no-sandbox");  // it refuses to start as root with one
    line.push_back(url_of(page));
    if (!ran(line) || !is_pdf(printed))
        throw Error(ErrorKind::input, "pdf.print", "the browser prints no PDF of the page", page,
                    "open the page in " + program + " and print it there");
    const fs::path beside = fs::path(pdf + ".partial");
    std::error_code error;
    fs::copy_file(printed, beside, fs::copy_options::overwrite_existing, error);
    if (!error) fs::rename(beside, place, error);
    if (!error) return;
    const std::string why = error.message();
    fs::remove(beside, error);
    throw Error(ErrorKind::input, "pdf.write", "cannot be written: " + why, pdf,
                "give another file after --pdf");
}

}  // namespace slabwright
