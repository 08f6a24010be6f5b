// The setup sheets on paper: a page of ours, printed to a PDF by an installed Chromium.
#pragma once

#include <string>

namespace slabwright {

/// Prints an HTML page of ours as its own rules for paper say. The browser is $SLABWRIGHT_CHROMIUM, or else
/// chromium, chromium-browser or google-chrome of $PATH; it runs without a window, a network and a profile of
/// its user.
/// @param pdf is written whole or not at all
/// @throws Error(usage, "pdf.browser") where there is none, Error(input, "pdf.print") where it does not print
/// within two minutes, Error(input, "pdf.write") where the file cannot be put in its place
void print_pdf(const std::string& page, const std::string& pdf);

}  // namespace slabwright
