#include "tools/map/raster_csv.hpp"

#include "ports/host/text_lines.hpp"

#include <cstdarg>
#include <cstdio>

namespace gpom_tools
{
void append_text(std::string &text, const char *format, ...)
{
    char line[512];
    va_list values;
    va_start(values, format);
    std::vsnprintf(line, sizeof line, format, values);
    va_end(values);
    text += line;
}

std::string probabilities_csv(const std::vector<gpom_point_t> &points,
                              const std::vector<double> &probabilities)
{
    std::string text = "x,y,probability\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (const double coordinate_m : {points[i].x_m, points[i].y_m}) { // like answers_csv()
            append_number(text, coordinate_m);
            text += ',';
        }
        append_text(text, "%.6g\n", probabilities[i]);
    }
    return text;
}

} // namespace gpom_tools
