// How the command and the benchmarks take memory from the system: by jemalloc, in huge pages, and what is given back is kept for three seconds. A plan of 10 M
// facets touches new pages half a million times less, which on a virtual machine is a sixth of its time. The library leaves this to the program that embeds it.
#include <jemalloc/jemalloc.h>

// jemalloc reads it as it starts; the environment's MALLOC_CONF goes before. Its rule that large pieces go back to the system at once
// (oversize_threshold) would have every array of a layer cleared anew for the next one. Kept longer, memory would outgrow what is charged by more than
// --memory allows for.
extern "C" {
__attribute__((visibility("default"))) const char* malloc_conf = "thp:always,oversize_threshold:0,dirty_decay_ms:3000";
}
