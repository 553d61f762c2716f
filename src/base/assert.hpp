/// \file assert.hpp
/// Checks of internal contracts. Every test build has them (GPOM_ASSERTS=1), a release has none.
#pragma once

#if GPOM_ASSERTS
#define GPOM_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())
#else
#define GPOM_ASSERT(condition) ((void)0)
#endif
