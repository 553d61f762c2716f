#include "tools/map/answer_csv.hpp"

#include "ports/host/text_lines.hpp"

namespace gpom_tools
{

namespace
{

constexpr const char *kClassNames[] = {"free", "unsure", "occupied"};

template <typename Number> void append_field(std::string &text, Number value)
{
    append_number(text, value);
    text += ',';
}

/// The fields of an answer, without an end of the line.
void append_answer(std::string &text, const gpom_point_t &point, const gpom_answer_t &answer)
{
    for (const double coordinate_m : {point.x_m, point.y_m}) {
        append_field(text, coordinate_m);
    }
    for (const float value : {answer.mean, answer.variance, answer.probability}) {
        append_field(text, value);
    }
    text += kClassNames[answer.cls];
}

} // namespace

std::vector<gpom_point_t> read_points(const std::string &path)
{
    LineReader reader(path, "points, x,y a line");
    std::vector<gpom_point_t> points;
    std::vector<std::string_view> fields;
    std::string line;
    while (reader.next(line)) {
        const std::string_view text = trimmed(line);
        if (text.empty() || text[0] == '#' || (points.empty() && text == "x,y")) {
            continue;
        }
        split_commas(text, fields);
        if (fields.size() != 2) {
            reader.place().fail("point has " + std::to_string(fields.size()) + " fields; need x,y");
        }
        points.push_back({parse_finite(fields[0], "x", reader.place()),
                          parse_finite(fields[1], "y", reader.place())});
        reader.require_line_end();
    }
    if (points.empty()) {
        reader.place().fail("no points in this file; need x,y a line");
    }
    return points;
}

std::vector<gpom_point_t> cell_centres(const gpom_raster_t &raster)
{
    std::vector<gpom_point_t> centres;
    centres.reserve(static_cast<std::size_t>(raster.nx) * raster.ny);
    for (std::uint32_t iy = 0; iy < raster.ny; ++iy) {
        for (std::uint32_t ix = 0; ix < raster.nx; ++ix) {
            centres.push_back({raster.x0_m + (ix + 0.5) * raster.cell_m,
                               raster.y0_m + (iy + 0.5) * raster.cell_m});
        }
    }
    return centres;
}

std::string answers_csv(const std::vector<gpom_point_t> &points,
                        const std::vector<gpom_answer_t> &answers)
{
    std::string text = "x,y,mean,variance,probability,class\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
        append_answer(text, points[i], answers[i]);
        text += '\n';
    }
    return text;
}

std::string gradients_csv(const std::vector<gpom_point_t> &points,
                          const std::vector<gpom_gradient_t> &gradients)
{
    std::string text = "x,y,mean,variance,probability,class,mean_x,mean_y,variance_x,variance_y,"
                       "probability_x,probability_y\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
        const gpom_gradient_t &g = gradients[i];
        append_answer(text, points[i], g.answer);
        for (const float slope :
             {g.mean_x, g.mean_y, g.variance_x, g.variance_y, g.probability_x, g.probability_y}) {
            text += ',';
            append_number(text, slope);
        }
        text += '\n';
    }
    return text;
}

std::string beams_csv(const std::vector<gpom_beam_t> &beams)
{
    std::string text = "id,stamp_us,x_m,y_m,dir_x,dir_y,range_m,hit_noise,free_noise,is_hit,"
                       "is_free,returned,provisional,past,n_agreed\n";
    for (const gpom_beam_t &beam : beams) {
        text += std::to_string(beam.id) + ',' + std::to_string(beam.stamp_us) + ',';
        append_field(text, beam.x_m);
        append_field(text, beam.y_m);
        for (const float value :
             {beam.dir_x, beam.dir_y, beam.range_m, beam.hit_noise, beam.free_noise}) {
            append_field(text, value);
        }
        for (const int flag :
             {beam.is_hit, beam.is_free, beam.returned, beam.provisional, beam.past}) {
            text += std::to_string(flag) + ',';
        }
        text += std::to_string(beam.n_agreed) + '\n';
    }
    return text;
}

} // namespace gpom_tools
