/// \file assert.hpp
/// Internal contracts. On in every test build (GPOM_ASSERTS=1), absent in a release.
#pragma once

#if GPOM_ASSERTS
#define GPOM_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())
#else
#define GPOM_ASSERT(condition) ((void)0)
#endif
