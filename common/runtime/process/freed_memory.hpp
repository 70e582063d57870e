#pragma once

#include <malloc.h>

namespace seastitch {

// For main(): makes glibc keep freed memory for its next use. By default glibc returns large blocks
// to the kernel at once and gets them again page by page, which takes a fifth of the time of a
// registration. All threads share two heaps, so that one uses what another freed: a heap each takes
// a tenth more memory and saves no time.
inline void KeepFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  mallopt(M_ARENA_MAX, 2);
}

// Gives the kernel what is free now, and from now on blocks as large as a raster as they are freed:
// before work that needs each of them once. Smaller ones, such as the soundings of a submap, are
// needed again and again.
inline void ReturnFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 8 << 20);
  malloc_trim(0);
}

}  // namespace seastitch
