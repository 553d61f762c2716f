/// \file check.hpp
/// Checks of numbers that come from outside the library. A NaN fails each check.
#pragma once

#include <float.h>

namespace gpom
{

template <class T> constexpr bool is_between(T x, T low, T high) { return x >= low && x <= high; }

constexpr bool is_within(double x, double limit) { return is_between(x, -limit, limit); }

constexpr bool is_finite(double x) { return is_within(x, DBL_MAX); }

} // namespace gpom
