// Names the processor of a run, so that its figures can be compared with those of another.
#ifndef GPOM_BENCH_PROCESSOR_HPP
#define GPOM_BENCH_PROCESSOR_HPP

#include <cstddef>
#include <fstream>
#include <string>

namespace gpom_bench
{

/// The value of the first line of /proc/cpuinfo with this key. Empty if there is none.
inline std::string cpuinfo(const std::string &key)
{
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        const std::size_t colon = line.find(": ");
        if (colon != std::string::npos && line.rfind(key, 0) == 0 &&
            line.find_first_not_of("\t ", key.size()) == colon) {
            return line.substr(colon + 2);
        }
    }
    return "";
}

/// Name, family and model: virtual machines hide the name's last part, but neither number.
inline std::string processor_name()
{
    const std::string name = cpuinfo("model name");
    if (name.empty()) {
        return "unknown";
    }
    return name + ", family " + cpuinfo("cpu family") + ", model " + cpuinfo("model");
}

} // namespace gpom_bench

#endif
