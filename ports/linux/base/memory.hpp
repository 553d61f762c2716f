// All memory of the daemon. It is taken from the system once.
#ifndef GPOM_LINUX_MEMORY_HPP
#define GPOM_LINUX_MEMORY_HPP

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// One block of zeros. It is resident from the start, never given back, and handed out in pieces.
class Memory {
public:
    /// False: the system does not have so much memory, or `n_bytes` is 0.
    bool reserve(std::size_t n_bytes);

    /// Hand out `n` objects of a type for which all bytes 0 is a valid start value. In total no
    /// more than the reserved bytes may be taken.
    template <class Type> Type *take(std::size_t n)
    {
        return static_cast<Type *>(take_bytes(n * sizeof(Type)));
    }

    /// Bytes that take() uses for `n` objects.
    template <class Type> static constexpr std::size_t need(std::size_t n)
    {
        return rounded(n * sizeof(Type));
    }

private:
    static constexpr std::size_t kAlignment = 64;
    static constexpr std::size_t rounded(std::size_t n_bytes)
    {
        return (n_bytes + kAlignment - 1) / kAlignment * kAlignment;
    }
    void *take_bytes(std::size_t n_bytes);

    std::uint8_t *begin_ = nullptr;
    std::size_t n_bytes_ = 0;
    std::size_t n_taken_ = 0;
};

/// Resident memory of this process [bytes]. 0: not known.
std::int64_t resident_bytes();

} // namespace gpomd

#endif
