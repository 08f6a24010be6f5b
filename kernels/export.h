// What the shared library shows to the outside; everything else in it is hidden.
#pragma once
#define SLABWRIGHT_API __attribute__((visibility("default")))
