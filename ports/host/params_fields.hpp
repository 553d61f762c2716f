// The hyperparameters, one row each: all that reads, writes or explains them goes by this table.
#ifndef GPOM_PORTS_HOST_PARAMS_FIELDS_HPP
#define GPOM_PORTS_HOST_PARAMS_FIELDS_HPP

#include "gpom/params.h"

#include <cstddef>
#include <cstdint>

namespace gpom_tools
{

struct NamedKernel {
    const char *name;     ///< In TOML.
    const char *constant; ///< In C.
    std::int32_t kernel;
};

inline constexpr NamedKernel kKernels[] = {
    {"nn", "GPOM_KERNEL_NN", GPOM_KERNEL_NN},
    {"matern12", "GPOM_KERNEL_MATERN12", GPOM_KERNEL_MATERN12},
    {"matern32", "GPOM_KERNEL_MATERN32", GPOM_KERNEL_MATERN32},
    {"se", "GPOM_KERNEL_SE", GPOM_KERNEL_SE},
    {"askey", "GPOM_KERNEL_ASKEY", GPOM_KERNEL_ASKEY}};

struct NamedFrame {
    const char *name;
    const char *constant;
    std::int32_t frame;
};

inline constexpr NamedFrame kFrames[] = {{"query", "GPOM_FRAME_QUERY", GPOM_FRAME_QUERY},
                                         {"map", "GPOM_FRAME_MAP", GPOM_FRAME_MAP}};

/// Which kernels use a field, and what it is where TOML leaves it out.
enum class Presence {
    kNeeded,       ///< Every kernel; TOML must give it.
    kNn,           ///< The kernel nn alone; TOML must give it.
    kOtherKernels, ///< All but nn; TOML must give it.
    kNeutral,      ///< Every kernel; 0, which switches it off.
    kAsHits        ///< Every kernel; sn2.
};

/// A number or a count of gpom_params_t; the other pointer is null.
struct ParamField {
    const char *key;   ///< In TOML.
    const char *field; ///< In C.
    float gpom_params_t::*number;
    std::uint16_t gpom_params_t::*count;
    Presence presence;
    unsigned count_max = 0;

    constexpr bool is_used_by(std::int32_t kernel) const
    {
        return presence == Presence::kNn             ? kernel == GPOM_KERNEL_NN
               : presence == Presence::kOtherKernels ? kernel != GPOM_KERNEL_NN
                                                     : true;
    }
};

#define GPOM_NUMBER(name, presence)                                                                \
    {                                                                                              \
#name, #name, &gpom_params_t::name, nullptr, presence                                      \
    }
#define GPOM_COUNT(key, name, presence, most)                                                      \
    {                                                                                              \
        key, #name, nullptr, &gpom_params_t::name, presence, most                                  \
    }

/// All but struct_bytes, kernel and frame, in the order of gpom_params_t.
inline constexpr ParamField kParamFields[] = {
    GPOM_NUMBER(sf2, Presence::kNeeded),
    GPOM_NUMBER(s0, Presence::kNn),
    GPOM_NUMBER(s1, Presence::kNn),
    GPOM_NUMBER(ell_m, Presence::kOtherKernels),
    GPOM_NUMBER(sn2, Presence::kNeeded),
    GPOM_NUMBER(sn2_free, Presence::kAsHits),
    GPOM_NUMBER(alpha, Presence::kNeeded),
    GPOM_NUMBER(beta, Presence::kNeeded),
    GPOM_NUMBER(gap_m, Presence::kNeeded),
    GPOM_NUMBER(p_occupied, Presence::kNeeded),
    GPOM_NUMBER(p_free, Presence::kNeeded),
    GPOM_COUNT("hits", n_hits, Presence::kNeeded, GPOM_SPARSE_POINTS_MAX),
    GPOM_COUNT("free", n_free, Presence::kNeeded, GPOM_SPARSE_POINTS_MAX),
    GPOM_COUNT("scan_points_max", scan_points_max, Presence::kNeutral, GPOM_POINTS_MAX),
    GPOM_COUNT("fading", n_fading, Presence::kNeutral, GPOM_SPARSE_POINTS_MAX),
    GPOM_NUMBER(depth_m, Presence::kNeutral),
    GPOM_NUMBER(anisotropy, Presence::kNeutral),
    GPOM_NUMBER(vote, Presence::kNeutral),
    GPOM_NUMBER(log_hit_first, Presence::kNeutral),
    GPOM_NUMBER(log_hit_last, Presence::kNeutral),
    GPOM_NUMBER(log_free_first, Presence::kNeutral),
    GPOM_NUMBER(log_free_last, Presence::kNeutral),
    GPOM_NUMBER(fade_m, Presence::kNeutral),
    GPOM_NUMBER(beta_far, Presence::kNeutral),
    GPOM_NUMBER(sn2_once, Presence::kNeutral),
    GPOM_NUMBER(line, Presence::kNeutral)};

#undef GPOM_NUMBER
#undef GPOM_COUNT

namespace detail
{

constexpr std::size_t bytes_of_fields()
{
    std::size_t bytes = sizeof(gpom_params_t::struct_bytes) + sizeof(gpom_params_t::kernel) +
                        sizeof(gpom_params_t::frame);
    for (const ParamField &field : kParamFields) {
        bytes += field.number != nullptr ? sizeof(float) : sizeof(std::uint16_t);
    }
    return bytes;
}

static_assert(bytes_of_fields() == sizeof(gpom_params_t), "a field of gpom_params_t has no row");

} // namespace detail

/// What the kernel does not use gets its value of gpom_params_init(): equal parameters then have
/// equal bits, whatever file they were in.
inline void reset_unused(gpom_params_t &params)
{
    gpom_params_t defaults;
    gpom_params_init(&defaults);
    for (const ParamField &field : kParamFields) {
        if (!field.is_used_by(params.kernel)) {
            params.*field.number = defaults.*field.number;
        }
    }
}

} // namespace gpom_tools

#endif
