#include "src/align/solve.hpp"

#include "src/lane/lane.hpp"

#include <float.h>

namespace gpom
{

namespace
{

using Matrix = Eigen::Matrix3f;
using Vector = Eigen::Vector3f;

constexpr float kUnknownSd = 1e6f;

float sd_of(float information)
{
    constexpr float kLeast = 1.0f / (kUnknownSd * kUnknownSd);
    return 1.0f / lane::sqrt(lane::max(information, kLeast));
}

} // namespace

bool invert(const Matrix &matrix, Matrix &inverse)
{
    Vector scale;
    for (int i = 0; i < 3; ++i) {
        if (!(matrix(i, i) > 0.0f && matrix(i, i) <= FLT_MAX)) { // NaN fails too
            return false;
        }
        scale(i) = 1.0f / lane::sqrt(matrix(i, i));
    }
    const float a = matrix(1, 0) * scale(0) * scale(1); // correlations
    const float b = matrix(2, 0) * scale(0) * scale(2);
    const float c = matrix(2, 1) * scale(1) * scale(2);
    const float det = 1.0f + 2.0f * a * b * c - a * a - b * b - c * c;
    if (!(det > 1e-6f)) {
        return false;
    }
    inverse << 1.0f - c * c, b * c - a, a * c - b, b * c - a, 1.0f - b * b, a * b - c, a * c - b,
        a * b - c, 1.0f - a * a;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            inverse(i, j) *= scale(i) * scale(j) / det;
        }
    }
    return true;
}

bool information_of(const float *cov, Matrix &information)
{
    constexpr float kExact = 1e-8f;
    Matrix sum;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            sum(i, j) = 0.5f * (cov[3 * i + j] + cov[3 * j + i]);
        }
        sum(i, i) = 1.0001f * sum(i, i) + kExact;
    }
    return invert(sum, information);
}

Weakness weakness_of(const Matrix &h)
{
    // Schur complements: the information about the place without the yaw, and the other way round.
    const float yaw = lane::max(h(2, 2), FLT_MIN);
    const float xx = h(0, 0) - h(0, 2) * h(0, 2) / yaw;
    const float xy = h(0, 1) - h(0, 2) * h(1, 2) / yaw;
    const float yy = h(1, 1) - h(1, 2) * h(1, 2) / yaw;
    const float spread = lane::sqrt((xx - yy) * (xx - yy) + 4.0f * xy * xy);
    const Eigen::Vector2f strong = xx >= yy ? Eigen::Vector2f(xx - yy + spread, 2.0f * xy)
                                            : Eigen::Vector2f(2.0f * xy, yy - xx + spread);
    const float length = lane::sqrt(strong.squaredNorm());
    const float det = h(0, 0) * h(1, 1) - h(0, 1) * h(0, 1);
    const float lost = h(1, 1) * h(0, 2) * h(0, 2) - 2.0f * h(0, 1) * h(0, 2) * h(1, 2) +
                       h(0, 0) * h(1, 2) * h(1, 2);
    const Eigen::Vector2f weak = length > 0.0f
                                     ? Eigen::Vector2f(-strong.y() / length, strong.x() / length)
                                     : Eigen::Vector2f(1.0f, 0.0f);
    return {weak, sd_of(0.5f * (xx + yy - spread)),
            sd_of(det > 0.0f ? h(2, 2) - lost / det : 0.0f)};
}

} // namespace gpom
