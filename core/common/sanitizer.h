#pragma once

// Macros that say which sanitizer the program is built with, each 0 or 1. GCC and Clang tell it in
// different ways.

#if defined(__has_feature)
#define POLYEST_HAS_FEATURE(feature) __has_feature(feature)
#else
#define POLYEST_HAS_FEATURE(feature) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || POLYEST_HAS_FEATURE(address_sanitizer)
#define POLYEST_ADDRESS_SANITIZER 1
#else
#define POLYEST_ADDRESS_SANITIZER 0
#endif

#if defined(__SANITIZE_THREAD__) || POLYEST_HAS_FEATURE(thread_sanitizer)
#define POLYEST_THREAD_SANITIZER 1
#else
#define POLYEST_THREAD_SANITIZER 0
#endif
