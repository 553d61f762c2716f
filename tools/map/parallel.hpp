// A parallel loop whose result does not depend on the number of cores.
#ifndef GPOM_TOOLS_MAP_PARALLEL_HPP
#define GPOM_TOOLS_MAP_PARALLEL_HPP

#include <algorithm>
#include <cstddef>
#include <thread>
#include <vector>

namespace gpom_tools
{

/// Number of items that a thread takes at a time. Sums are made for each chunk, then over the
/// chunks in order.
constexpr std::size_t kParallelChunk = 64;

inline std::size_t chunk_count(std::size_t n) { return (n + kParallelChunk - 1) / kParallelChunk; }

/// Call body(i_chunk, first, last) for every chunk of 0 .. n on `n_threads` threads. 0: all cores.
/// The body must not throw.
template <class Body> void for_chunks(std::size_t n, unsigned n_threads, const Body &body)
{
    const std::size_t n_chunks = chunk_count(n);
    const std::size_t n_cores = n_threads > 0 ? n_threads : std::thread::hardware_concurrency();
    const std::size_t stride =
        std::clamp<std::size_t>(n_cores, 1, std::max<std::size_t>(n_chunks, 1));
    const auto run = [&](std::size_t i_first) {
        for (std::size_t i = i_first; i < n_chunks; i += stride) {
            body(i, i * kParallelChunk, std::min(n, (i + 1) * kParallelChunk));
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t i = 1; i < stride; ++i) {
        threads.emplace_back(run, i);
    }
    run(0);
    for (std::thread &thread : threads) {
        thread.join();
    }
}

} // namespace gpom_tools

#endif
