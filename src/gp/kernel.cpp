#include "src/gp/kernel.hpp"

namespace gpom
{

KernelConstants kernel_constants(const gpom_params_t &params)
{
    if (params.kernel == GPOM_KERNEL_NN) {
        return {params.sf2, lane::sqrt(2.0f * params.s0), lane::sqrt(2.0f * params.s1)};
    }
    return {params.sf2, 0.0f, units_per_ell(params.kernel) / params.ell_m};
}

namespace
{

template <gpom_kernel_t K> float on_axis(const gpom_params_t &params, float x1_m, float x2_m)
{
    const KernelConstants constants = kernel_constants(params);
    const float apart =
        separation<K>(feature<K>(constants, x1_m, 0.0f), feature<K>(constants, x2_m, 0.0f));
    return constants.sf2 * unit_covariance<K>(apart);
}

} // namespace

float covariance_on_axis(const gpom_params_t &params, float x1_m, float x2_m)
{
    switch (params.kernel) {
    case GPOM_KERNEL_NN:
        return on_axis<GPOM_KERNEL_NN>(params, x1_m, x2_m);
    case GPOM_KERNEL_MATERN12:
        return on_axis<GPOM_KERNEL_MATERN12>(params, x1_m, x2_m);
    case GPOM_KERNEL_MATERN32:
        return on_axis<GPOM_KERNEL_MATERN32>(params, x1_m, x2_m);
    case GPOM_KERNEL_SE:
        return on_axis<GPOM_KERNEL_SE>(params, x1_m, x2_m);
    default:
        return on_axis<GPOM_KERNEL_ASKEY>(params, x1_m, x2_m);
    }
}

} // namespace gpom
